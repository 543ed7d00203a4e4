#include "platform/video/recording_frame_source.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <thread>
#include <vector>

#include "test/platform/support/eventually.h"
#include "test/platform/support/picture_files.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

// A recording whose frame n is of one grey, 10 n.
struct Recording {
  explicit Recording(int rows) {
    directory.write("recording.yaml", "format: 1\nwidth: 32\nheight: 16\n");
    std::string table = "frame,receive_time_s,sequence\n";
    for (int i = 0; i < rows; ++i) {
      table += std::to_string(i) + "," + std::to_string(100 + i * 0.01) + "," +
               std::to_string(7 * i) + "\n";
    }
    directory.write("frames.csv", table);
  }

  RecordingFrameSourceOptions options() const {
    RecordingFrameSourceOptions result;
    result.directory = directory.path();
    return result;
  }

  std::vector<int> greys_until_end() const {
    const auto source = open_recorded_frames(options());
    Frame frame;
    std::vector<int> greys;
    while (source->read(frame, 0) == ReadStatus::kOk) {
      greys.push_back(frame.luma[15 * frame.stride + 31]);
      EXPECT_EQ(frame.stamp.sequence, 7 * frame.stamp.frame);
    }
    EXPECT_EQ(source->read(frame, 0), ReadStatus::kEnd) << source->error();
    return greys;
  }

  std::string error() const {
    const auto source = open_recorded_frames(options());
    Frame frame;
    ReadStatus status = ReadStatus::kOk;
    while (status == ReadStatus::kOk) {
      status = source->read(frame, 0);
    }
    EXPECT_EQ(status, ReadStatus::kFailed);
    EXPECT_EQ(source->read(frame, 0), ReadStatus::kFailed);
    return source->error();
  }

  TemporaryDirectory directory;
};

TEST(RecordingFrameSource, ReadsPicturesOfEachType) {
  const Recording recording(3);
  recording.directory.write("frames/000000.png", picture_file("png", 32, 16, 0));
  recording.directory.write("frames/000001.pgm", picture_file("pgm", 32, 16, 10));
  recording.directory.write("frames/000002.jpg", picture_file("mjpeg", 32, 16, 20));
  EXPECT_THAT(recording.greys_until_end(), ElementsAre(0, 10, 20));
}

TEST(RecordingFrameSource, FindsAPictureByItsFrameNumber) {
  const Recording recording(0);
  recording.directory.write("frames.csv",
                            "frame,receive_time_s,sequence\n2,1,14\n1234567,2,8641969\n");
  recording.directory.write("frames/000002.pgm", picture_file("pgm", 32, 16, 20));
  recording.directory.write("frames/1234567.pgm", picture_file("pgm", 32, 16, 30));
  EXPECT_THAT(recording.greys_until_end(), ElementsAre(20, 30));
}

TEST(RecordingFrameSource, KeepsRowsAndPicturesTogetherInAVideoWithReorderedFrames) {
  const Recording recording(20);
  write_video(recording.directory.path() + "/video.mkv", 32, 16, 20, 3);
  const std::vector<int> greys = recording.greys_until_end();
  ASSERT_EQ(greys.size(), 20U);
  for (int i = 0; i < 20; ++i) {
    EXPECT_NEAR(greys[static_cast<std::size_t>(i)], 10 * i + 20, 3);
  }
}

// Its remarks when it was read to its end.
std::vector<std::string> remarks_of(const Recording& recording) {
  const auto source = open_recorded_frames(recording.options());
  Frame frame;
  while (source->read(frame, 0) == ReadStatus::kOk) {
  }
  return source->remarks();
}

TEST(RecordingFrameSource, RemarksOnBFramesAndOnNothingElse) {
  const Recording recording(20);
  write_video(recording.directory.path() + "/video.mkv", 32, 16, 20, 0);
  EXPECT_THAT(remarks_of(recording), ElementsAre());
  write_video(recording.directory.path() + "/video.mkv", 32, 16, 20, 3);
  EXPECT_THAT(remarks_of(recording),
              ElementsAre(AllOf(HasSubstr(recording.directory.path() + "/video.mkv has B-frames"),
                                HasSubstr("row k of frames.csv must belong to"))));
}

TEST(RecordingFrameSource, RefusesRowsInTheOrderOfPacketsBesideBFrames) {
  const Recording recording(0);
  // Row by row the sender's time of an I, a P and the B-frames between; and the same in order.
  std::string as_they_came = "frame,receive_time_s,sender_time_s\n";
  std::string in_order = as_they_came;
  const int order[] = {0, 4, 1, 2, 3, 8, 5, 6, 7};
  for (int i = 0; i < 9; ++i) {
    const auto row = [i](int time) {
      return std::to_string(i) + "," + std::to_string(100 + 0.04 * i) + "," +
             std::to_string(7 + 0.04 * time) + "\n";
    };
    as_they_came += row(order[i]);
    in_order += row(i);
  }
  write_video(recording.directory.path() + "/video.mkv", 32, 16, 9, 3);
  recording.directory.write("frames.csv", as_they_came);
  EXPECT_THAT(recording.error(), HasSubstr("/frames.csv: sender_time_s steps back, and video.mkv"));
  recording.directory.write("frames.csv", in_order);
  EXPECT_EQ(remarks_of(recording).size(), 1U);
  // Without B-frames rows may be of a sender that began anew.
  write_video(recording.directory.path() + "/video.mkv", 32, 16, 9, 0);
  recording.directory.write("frames.csv", as_they_came);
  EXPECT_THAT(remarks_of(recording), ElementsAre());
}

TEST(RecordingFrameSource, EndsWhereACutOffVideoEndsAndTellsHowManyFramesAreMissing) {
  const Recording recording(20);
  const std::string path = recording.directory.path() + "/video.mkv";
  write_video(path, 32, 16, 20, 0);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) * 2 / 3);
  const auto source = open_recorded_frames(recording.options());
  Frame frame;
  std::int64_t frames = 0;
  while (source->read(frame, 0) == ReadStatus::kOk) {
    EXPECT_NEAR(frame.luma[0], 10 * static_cast<int>(frames) + 20, 3);
    ++frames;
  }
  EXPECT_EQ(source->read(frame, 0), ReadStatus::kEnd) << source->error();
  EXPECT_GT(frames, 0);
  EXPECT_LT(frames, 20);
  EXPECT_EQ(frames + source->missing_frames() + source->damaged_frames(), 20);
}

TEST(RecordingFrameSource, EndsWithTheTableWhenTheVideoIsLonger) {
  const Recording recording(5);
  write_video(recording.directory.path() + "/video.mkv", 32, 16, 8, 0);
  EXPECT_EQ(recording.greys_until_end().size(), 5U);
}

TEST(RecordingFrameSource, SkipsAndCountsAPictureThatCannotBeDecoded) {
  const Recording recording(4);
  const std::string jpeg = picture_file("mjpeg", 32, 16, 50);
  recording.directory.write("frames/000000.jpg", jpeg);
  recording.directory.write("frames/000001.jpg", jpeg.substr(0, jpeg.size() / 2));
  recording.directory.write("frames/000002.jpg", "");
  recording.directory.write("frames/000003.jpg", jpeg);
  const auto source = open_recorded_frames(recording.options());
  Frame frame;
  ASSERT_EQ(source->read(frame, 0), ReadStatus::kOk) << source->error();
  ASSERT_EQ(source->read(frame, 0), ReadStatus::kOk) << source->error();
  EXPECT_EQ(frame.stamp.frame, 3);
  EXPECT_EQ(source->read(frame, 0), ReadStatus::kEnd);
  EXPECT_EQ(source->damaged_frames(), 2);
}

TEST(RecordingFrameSource, YieldsStampsAloneFromTracksOrWhenNotToDecode) {
  const Recording recording(3);
  recording.directory.write("tracks.csv", "frame,landmark,u_px,v_px,sigma_px\n");
  const auto tracks = open_recorded_frames(recording.options());
  std::filesystem::create_directory(recording.directory.path() + "/frames");
  RecordingFrameSourceOptions options = recording.options();
  options.decode = false;
  const auto pictures = open_recorded_frames(options);
  for (RecordingFrameSource* source : {tracks.get(), pictures.get()}) {
    Frame frame;
    if (source == tracks.get()) {
      std::filesystem::remove(recording.directory.path() + "/frames");
    }
    for (int i = 0; i < 3; ++i) {
      ASSERT_EQ(source->read(frame, 0), ReadStatus::kOk) << source->error();
      EXPECT_EQ(frame.stamp.frame, i);
      EXPECT_EQ(frame.luma, nullptr);
      EXPECT_EQ(frame.width, 32);
      EXPECT_EQ(frame.height, 16);
    }
    EXPECT_EQ(source->read(frame, 0), ReadStatus::kEnd);
  }
}

TEST(RecordingFrameSource, EndsAtOnceWithoutRows) {
  const Recording recording(0);
  recording.directory.write("tracks.csv", "frame,landmark,u_px,v_px,sigma_px\n");
  EXPECT_TRUE(recording.greys_until_end().empty());
}

TEST(RecordingFrameSource, SaysWhatIsMissing) {
  const Recording recording(2);
  EXPECT_THAT(recording.error(), HasSubstr("no pictures; a recording holds video.mkv, frames/ or"));
  recording.directory.write("frames/000000.pgm", picture_file("pgm", 32, 16, 0));
  EXPECT_THAT(recording.error(), HasSubstr("frames/000001: frames.csv has a row for this picture"));
  recording.directory.write("frames.csv", "frame,receive_time_s\n0,zero\n");
  EXPECT_THAT(recording.error(), HasSubstr("frames.csv:2: 'zero'"));
  std::filesystem::remove(recording.directory.path() + "/recording.yaml");
  EXPECT_THAT(recording.error(), HasSubstr("recording.yaml: cannot be read"));
}

TEST(RecordingFrameSource, RefusesPicturesOfAnotherSizeThanTheRecordingSays) {
  const Recording recording(1);
  recording.directory.write("frames/000000.pgm", picture_file("pgm", 16, 32, 0));
  EXPECT_THAT(recording.error(),
              HasSubstr("recording.yaml: the size is given as 32x16, frame 0 has "
                        "16x32"));
}

TEST(RecordingFrameSource, RefusesAFileThatIsNoVideo) {
  const Recording recording(1);
  recording.directory.write("video.mkv", "this is no video");
  EXPECT_THAT(recording.error(), HasSubstr("video.mkv: Invalid data"));
}

TEST(RecordingFrameSource, KeepsThePaceOfTheRecordingWhenAskedToAndStops) {
  const Recording recording(0);
  recording.directory.write("frames.csv", "frame,receive_time_s\n0,100\n1,100.02\n2,1000100\n");
  recording.directory.write("tracks.csv", "frame,landmark,u_px,v_px,sigma_px\n");
  RecordingFrameSourceOptions options = recording.options();
  options.realtime = true;
  const auto source = open_recorded_frames(options);
  Frame frame;
  ASSERT_EQ(source->read(frame, 0), ReadStatus::kOk) << source->error();
  ASSERT_EQ(source->read(frame, kNever_s), ReadStatus::kOk);
  EXPECT_EQ(frame.stamp.receive_time_s, 100.02);
  EXPECT_EQ(source->read(frame, 0.01), ReadStatus::kTimeout);
  std::thread stopper([&source] { source->stop(); });
  EXPECT_EQ(source->read(frame, kNever_s), ReadStatus::kStopped);
  stopper.join();
}

}  // namespace
}  // namespace alidade
