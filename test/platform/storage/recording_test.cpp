#include "platform/storage/recording.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <ostream>

#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// One table of a recording, as it is read back.
template <class Row>
struct ReadTable {
  using Reader = bool (*)(const std::string&, std::vector<Row>*, std::string*);
  ReadTable(const char* file, Reader read, const std::string& content) : name(file) {
    directory.write(name, content);
    ok = read(directory.path(), &rows, &error);
  }
  std::string at(int line) const {
    return directory.path() + "/" + name + ":" + std::to_string(line) + ": ";
  }
  TemporaryDirectory directory;
  std::string name;
  std::vector<Row> rows;
  std::string error;
  bool ok = false;
};
struct FramesCsv : ReadTable<FrameStamp> {
  explicit FramesCsv(const std::string& content)
      : ReadTable("frames.csv", read_frames_csv, content) {}
};
struct TelemetryCsv : ReadTable<PanTiltSample> {
  explicit TelemetryCsv(const std::string& content)
      : ReadTable("telemetry.csv", read_telemetry_csv, content) {}
};
struct TracksCsv : ReadTable<TrackPoint> {
  explicit TracksCsv(const std::string& content)
      : ReadTable("tracks.csv", read_tracks_csv, content) {}
};

TEST(TracksCsv, ReadsPointsAsTheyAre) {
  const TracksCsv csv(
      "landmark,quality,frame,v_px,u_px,sigma_px\n"
      "9007199254740991,good,3,-1.5,960.25,0.3\n"
      "9007199254740991,bad,3,1e3,0,0\n");
  ASSERT_TRUE(csv.ok) << csv.error;
  ASSERT_EQ(csv.rows.size(), 2U);
  EXPECT_EQ(csv.rows[0].frame, 3);
  EXPECT_EQ(csv.rows[0].landmark, 9007199254740991);
  EXPECT_EQ(csv.rows[0].u_px, 960.25);
  EXPECT_EQ(csv.rows[0].v_px, -1.5);
  EXPECT_EQ(csv.rows[0].sigma_px, 0.3);
  EXPECT_EQ(csv.rows[1].sigma_px, 0);
}

TEST(TracksCsv, NamesTheLineOfAMalformedRow) {
  const std::string header = "frame,landmark,u_px,v_px,sigma_px\n0,1,2,3,0.5\n";
  for (const auto& [row, what] : {std::pair("0,1,2,3\n", "fewer cells"),
                                  {"0,1,2,3,0.5,6\n", "more cells"},
                                  {"0,1,nan,3,0.5\n", "'nan' in column u_px is not a number"},
                                  {"0,1,2,inf,0.5\n", "'inf' in column v_px is not a number"},
                                  {"0,1.5,2,3,0.5\n", "'1.5' in column landmark"},
                                  {"0,1,2,3,\n", "'' in column sigma_px"},
                                  {"0,1,two,3,0.5\n", "'two' in column u_px"},
                                  {"0,1,2,3,0.5", "cut off"}}) {
    const TracksCsv csv(header + row);
    EXPECT_FALSE(csv.ok) << row;
    EXPECT_THAT(csv.error, StartsWith(csv.at(3)));
    EXPECT_THAT(csv.error, HasSubstr(what));
  }
  EXPECT_THAT(TracksCsv("frame,u_px,v_px,sigma_px\n").error,
              HasSubstr("tracks.csv:1: no column 'landmark'; the columns are frame,landmark,"));
}

TEST(FramesCsv, ReadsEveryColumnInAnyOrderAndIgnoresUnknownOnes) {
  const FramesCsv csv(
      "sequence,weather,receive_time_s,sender_utc_s,frame,restarted,sender_time_s\n"
      "70,fine,0.1,1700000000.5,3,1,5.25\n"
      ",,-2e-1,,4,,\n");
  ASSERT_TRUE(csv.ok) << csv.error;
  ASSERT_EQ(csv.rows.size(), 2U);
  EXPECT_EQ(csv.rows[0].frame, 3);
  EXPECT_EQ(csv.rows[0].receive_time_s, 0.1);
  EXPECT_EQ(csv.rows[0].sender_time_s, 5.25);
  EXPECT_EQ(csv.rows[0].sender_utc_s, 1700000000.5);
  EXPECT_EQ(csv.rows[0].sequence, 70);
  EXPECT_TRUE(csv.rows[0].restarted);
  EXPECT_EQ(csv.rows[1].frame, 4);
  EXPECT_EQ(csv.rows[1].receive_time_s, -0.2);
  EXPECT_EQ(csv.rows[1].sender_time_s, std::nullopt);
  EXPECT_EQ(csv.rows[1].sender_utc_s, std::nullopt);
  EXPECT_EQ(csv.rows[1].sequence, std::nullopt);
  EXPECT_FALSE(csv.rows[1].restarted);
}

TEST(FramesCsv, AcceptsWindowsLineEndsBlanksAndEmptyLines) {
  const FramesCsv csv("frame,receive_time_s\r\n 0 ,\t1.5 \r\n\r\n1,2.5\r\n");
  ASSERT_TRUE(csv.ok) << csv.error;
  ASSERT_EQ(csv.rows.size(), 2U);
  EXPECT_EQ(csv.rows[1].receive_time_s, 2.5);
}

TEST(FramesCsv, ReadsATableWithoutRows) {
  const FramesCsv csv("frame,receive_time_s\n");
  EXPECT_TRUE(csv.ok) << csv.error;
  EXPECT_TRUE(csv.rows.empty());
}

TEST(FramesCsv, PassesEqualAndJumpingStampsOn) {
  const FramesCsv csv("frame,receive_time_s\n0,5\n1,5\n2,1\n");
  ASSERT_TRUE(csv.ok) << csv.error;
  EXPECT_EQ(csv.rows[2].receive_time_s, 1);
}

struct Flaw {
  const char* name;
  const char* content;
  int line;
  const char* says;
};

void PrintTo(const Flaw& flaw, std::ostream* out) { *out << flaw.name; }

class MalformedFramesCsv : public ::testing::TestWithParam<Flaw> {};

TEST_P(MalformedFramesCsv, IsAnErrorThatNamesFileAndLineAndTheColumns) {
  const FramesCsv csv(GetParam().content);
  EXPECT_FALSE(csv.ok);
  EXPECT_THAT(csv.error, AllOf(StartsWith(csv.at(GetParam().line)), HasSubstr(GetParam().says),
                               HasSubstr("frame,receive_time_s[,sender_time_s]")));
}

INSTANTIATE_TEST_SUITE_P(
    Flaws, MalformedFramesCsv,
    ::testing::Values(
        Flaw{"TextForNumber", "frame,receive_time_s\n0,1\n1,soon\n", 3,
             "'soon' in column receive_time_s is not a number"},
        Flaw{"DecimalComma", "frame,receive_time_s\n0,1,5\n", 2, "more cells"},
        Flaw{"TrailingUnit", "frame,receive_time_s\n0,1s\n", 2, "'1s'"},
        Flaw{"NotANumber", "frame,receive_time_s\n0,nan\n", 2, "'nan'"},
        Flaw{"Infinite", "frame,receive_time_s\n0,1e999\n", 2, "'1e999'"},
        Flaw{"EmptyRequiredCell", "frame,receive_time_s\n0,\n", 2, "'' in column receive_time_s"},
        Flaw{"TextForOptionalNumber", "frame,receive_time_s,sequence\n0,1,x\n", 2, "'x'"},
        Flaw{"FractionalFrame", "frame,receive_time_s\n0.5,1\n", 2, "not a whole number"},
        Flaw{"BeyondWholeNumbers", "frame,receive_time_s\n9007199254740994,1\n", 2,
             "'9007199254740994' in column frame is not a whole number"},
        Flaw{"NegativeFrame", "frame,receive_time_s\n-1,1\n", 2, "negative frame"},
        Flaw{"ShortRow", "frame,receive_time_s\n0,1\n\n1\n", 4, "fewer cells"},
        Flaw{"MissingColumn", "frame,time\n0,1\n", 1, "no column 'receive_time_s'"},
        Flaw{"RepeatedColumn", "frame,frame,receive_time_s\n", 1, "column 'frame' is given twice"},
        Flaw{"Empty", "", 1, "no header line"}),
    [](const auto& flaw) { return flaw.param.name; });

TEST(FramesCsv, TakesAByteOrderMarkAndBlankLines) {
  const FramesCsv csv("\xEF\xBB\xBF \nframe,receive_time_s\n\t\n0,1\n");
  ASSERT_TRUE(csv.ok) << csv.error;
  EXPECT_EQ(csv.rows.size(), 1U);
}

TEST(FramesCsv, TakesANumberWithAZeroByteForNone) {
  const FramesCsv csv(std::string("frame,receive_time_s\n0,1\0005\n", 27));
  EXPECT_FALSE(csv.ok);
  EXPECT_THAT(csv.error, HasSubstr("'1\\x005' in column receive_time_s is not a number"));
}

TEST(FramesCsv, TakesAFileThatIsCutOffInItsLastNumberForMalformed) {
  const FramesCsv csv("frame,receive_time_s\n0,1.25\n1,1.5");
  EXPECT_FALSE(csv.ok);
  EXPECT_THAT(csv.error, AllOf(HasSubstr("/frames.csv:3: "), HasSubstr("cut off")));
}

TEST(FramesCsv, SaysThatItIsMissing) {
  const TemporaryDirectory directory;
  std::vector<FrameStamp> frames;
  std::string error;
  EXPECT_FALSE(read_frames_csv(directory.path(), &frames, &error));
  EXPECT_EQ(error, directory.path() + "/frames.csv: cannot be read: No such file or directory");
}

TEST(TelemetryCsv, ReadsEveryColumn) {
  const TelemetryCsv csv(
      "receive_time_s,pan_rad,tilt_rad,zoom,device_time_s,sequence,earliest_time_s,restarted\n"
      "1,0.5,-0.25,900,77.5,6,0.75,1\n");
  ASSERT_TRUE(csv.ok) << csv.error;
  ASSERT_EQ(csv.rows.size(), 1U);
  const PanTiltSample& sample = csv.rows[0];
  EXPECT_EQ(sample.latest_time_s, 1);
  EXPECT_EQ(sample.earliest_time_s, 0.75);
  EXPECT_EQ(sample.pan_rad, 0.5);
  EXPECT_EQ(sample.tilt_rad, -0.25);
  EXPECT_EQ(sample.zoom, 900);
  EXPECT_EQ(sample.device_time_s, 77.5);
  EXPECT_EQ(sample.sequence, 6);
  EXPECT_TRUE(sample.restarted);
}

TEST(TelemetryCsv, TakesASampleWithoutEarliestTimeForTrueAtItsReceiveTime) {
  const TelemetryCsv csv("receive_time_s,pan_rad,tilt_rad\n1.5,0,0\n");
  ASSERT_TRUE(csv.ok) << csv.error;
  EXPECT_EQ(csv.rows.at(0).earliest_time_s, 1.5);
  EXPECT_EQ(csv.rows.at(0).zoom, std::nullopt);
  EXPECT_FALSE(csv.rows.at(0).restarted);
}

TEST(TelemetryCsv, RejectsAnIntervalThatEndsBeforeItBegins) {
  const TelemetryCsv csv("receive_time_s,pan_rad,tilt_rad,earliest_time_s\n1,0,0,2\n");
  EXPECT_FALSE(csv.ok);
  EXPECT_THAT(csv.error, HasSubstr("telemetry.csv:2: earliest_time_s lies after"));
}

TEST(RecordingInfo, ReadsSizeAndNotesAndIgnoresOtherKeys) {
  const TemporaryDirectory directory;
  directory.write("recording.yaml", "format: 1\nwidth: 64\nheight: 48\nnotes: windy\nlens: new\n");
  RecordingInfo info;
  std::string error;
  ASSERT_TRUE(read_recording_info(directory.path(), &info, &error)) << error;
  EXPECT_EQ(info.width, 64);
  EXPECT_EQ(info.height, 48);
  EXPECT_EQ(info.notes, "windy");
}

class MalformedRecordingInfo : public ::testing::TestWithParam<Flaw> {};

TEST_P(MalformedRecordingInfo, IsAnErrorThatNamesFileAndLine) {
  const TemporaryDirectory directory;
  directory.write("recording.yaml", GetParam().content);
  RecordingInfo info;
  std::string error;
  EXPECT_FALSE(read_recording_info(directory.path(), &info, &error));
  EXPECT_THAT(error, AllOf(StartsWith(directory.path() +
                                      "/recording.yaml:" + std::to_string(GetParam().line) + ": "),
                           HasSubstr(GetParam().says)));
}

INSTANTIATE_TEST_SUITE_P(
    Flaws, MalformedRecordingInfo,
    ::testing::Values(
        Flaw{"LaterFormat", "format: 2\nwidth: 1\nheight: 1\n", 1, "not a recording of format 1"},
        Flaw{"NoFormat", "width: 1\nheight: 1\n", 1, "not a recording of format 1"},
        Flaw{"NoHeight", "format: 1\nwidth: 1\n", 1, "no height"},
        Flaw{"TextForNumber", "format: 1\nwidth: wide\nheight: 1\n", 2, "bad conversion"},
        Flaw{"ZeroHeight", "format: 1\nwidth: 1\nheight: 0\n", 3, "height must be positive"},
        Flaw{"NoYaml", "format: 1\nwidth: [\n", 3, ""}, Flaw{"List", "- 1\n", 1, "format 1"},
        Flaw{"Empty", "", 1, "format 1"}),
    [](const auto& flaw) { return flaw.param.name; });

TEST(RecordingInfo, SaysThatItIsMissing) {
  const TemporaryDirectory directory;
  RecordingInfo info;
  std::string error;
  EXPECT_FALSE(read_recording_info(directory.path() + "/nowhere", &info, &error));
  EXPECT_THAT(error, HasSubstr("/nowhere/recording.yaml: cannot be read"));
}

}  // namespace
}  // namespace alidade
