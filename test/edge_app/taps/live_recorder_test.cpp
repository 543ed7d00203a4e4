// A recording while the program goes on: what is stored, how it ends, and what is left out.

#include "edge_app/taps/live_recorder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

#include "platform/pan_tilt/recording_pan_tilt_source.h"
#include "platform/storage/recording.h"
#include "platform/video/recording_frame_source.h"
#include "test/edge_app/taps/kept_frame.h"
#include "test/platform/support/eventually.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using test::kept_frame;
using ::testing::HasSubstr;

constexpr double kPeriod_s = 0.02;

PanTiltSample sample_at(double time_s) {
  PanTiltSample sample;
  sample.earliest_time_s = sample.latest_time_s = time_s;
  sample.pan_rad = 0.1 * time_s;
  sample.tilt_rad = -0.05 * time_s;
  return sample;
}

class LiveRecorderTest : public ::testing::Test {
 protected:
  [[nodiscard]] LiveRecorderOptions options() const {
    LiveRecorderOptions out;
    out.parent = (std::filesystem::path(directory_.path()) / "recordings").string();
    return out;
  }
  LiveRecorder::Begin begin(double duration_s) { return recorder_.begin(duration_s, &error_); }
  void take(std::int64_t first, std::int64_t end) {
    for (std::int64_t i = first; i < end; ++i) {
      const double time_s = 100 + kPeriod_s * static_cast<double>(i);
      recorder_.take(sample_at(time_s));
      recorder_.take(kept_frame(i, time_s));
    }
  }
  [[nodiscard]] std::vector<std::int64_t> recorded_pictures() const {
    const auto recording = open_recorded_frames({recorder_.state().directory, true, false});
    std::vector<std::int64_t> out;
    for (Frame frame; recording->read(frame, 0) == ReadStatus::kOk;) {
      EXPECT_EQ(frame.stamp.frame, static_cast<std::int64_t>(out.size()));
      out.push_back(frame.luma[0]);
    }
    EXPECT_EQ(recording->missing_frames(), 0);
    return out;
  }
  [[nodiscard]] bool ends() const {
    return eventually([this] { return !recorder_.state().under_way; });
  }

  TemporaryDirectory directory_;
  std::string error_;
  LiveRecorder recorder_{options()};
};

TEST_F(LiveRecorderTest, StoresWhatComesUntilItsDurationIsOver) {
  take(0, 5);  // nothing is asked for yet
  EXPECT_EQ(recorder_.state().directory, "");
  ASSERT_EQ(begin(1), LiveRecorder::Begin::kBegun) << error_;
  EXPECT_TRUE(recorder_.takes());
  EXPECT_TRUE(recorder_.state().under_way);
  take(5, 80);
  ASSERT_TRUE(ends());
  EXPECT_FALSE(recorder_.takes());
  const LiveRecording done = recorder_.state();
  EXPECT_EQ(done.error, "");
  EXPECT_EQ(done.frames, 50);
  EXPECT_NEAR(done.length_s, 1, 1e-9);
  EXPECT_EQ(done.left_out, 0);
  const std::vector<std::int64_t> pictures = recorded_pictures();
  ASSERT_EQ(pictures.size(), 50U);
  EXPECT_EQ(pictures.front(), 5);
  EXPECT_EQ(pictures.back(), 54);
  // Telemetry from before the first picture is there, too.
  const auto telemetry = open_recorded_pan_tilt({done.directory, false});
  PanTiltSample sample;
  ASSERT_EQ(telemetry->read(sample, 0), ReadStatus::kOk) << telemetry->error();
  EXPECT_EQ(sample.latest_time_s, 100);
  EXPECT_GE(done.samples, 54);
}

TEST_F(LiveRecorderTest, EndsWhenAskedToAndBeginsAgainInAnotherDirectory) {
  std::vector<std::string> directories;
  for (int i = 0; i < 2; ++i) {
    ASSERT_EQ(begin(600), LiveRecorder::Begin::kBegun) << error_;
    EXPECT_EQ(begin(600), LiveRecorder::Begin::kUnderWay);
    EXPECT_THAT(error_, HasSubstr("end it first"));
    take(0, 20);
    EXPECT_TRUE(recorder_.end());
    EXPECT_FALSE(recorder_.end());
    const LiveRecording done = recorder_.state();
    EXPECT_FALSE(done.under_way);
    EXPECT_EQ(done.error, "");
    EXPECT_EQ(done.frames, 20) << "all that came before the end is written";
    directories.push_back(done.directory);
    EXPECT_EQ(recorded_pictures().size(), 20U);
  }
  EXPECT_NE(directories[0], directories[1]);
}

TEST_F(LiveRecorderTest, RefusesOtherDurationsAndPlacesThatCannotBeWritten) {
  for (const double duration_s : {0.0, -5.0, 0.99, 3601.0, std::numeric_limits<double>::quiet_NaN(),
                                  std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(begin(duration_s), LiveRecorder::Begin::kBadDuration) << duration_s;
    EXPECT_EQ(error_, "a recording lasts from 1 to 3600 s");
  }
  std::ofstream(options().parent) << "a file";
  EXPECT_EQ(begin(10), LiveRecorder::Begin::kFailed);
  EXPECT_THAT(error_, HasSubstr("set output.recordings to a directory that can be written"));
  EXPECT_FALSE(recorder_.state().under_way);
  EXPECT_FALSE(recorder_.takes());
}

TEST_F(LiveRecorderTest, HasTheFilesThatTheConfigurationStates) {
  LiveRecorderOptions with_files = options();
  bool works = true;
  with_files.write_side_files = [&works](const std::string& directory, std::string* error) {
    std::ofstream(std::filesystem::path(directory) / "guess.yaml") << "x";
    *error = "no place for guess.yaml";
    return works;
  };
  LiveRecorder recorder(with_files);
  ASSERT_EQ(recorder.begin(10, &error_), LiveRecorder::Begin::kBegun) << error_;
  EXPECT_TRUE(recorder.end());
  EXPECT_TRUE(
      std::filesystem::exists(std::filesystem::path(recorder.state().directory) / "guess.yaml"));
  works = false;
  EXPECT_EQ(recorder.begin(10, &error_), LiveRecorder::Begin::kFailed);
  EXPECT_EQ(error_, "no place for guess.yaml");
}

TEST_F(LiveRecorderTest, EndsAtAPictureOfAnotherSizeAndSaysWhy) {
  ASSERT_EQ(begin(600), LiveRecorder::Begin::kBegun) << error_;
  take(0, 10);
  recorder_.take(kept_frame(10, 100.2, 64, 16));
  ASSERT_TRUE(ends());
  EXPECT_THAT(recorder_.state().error, HasSubstr("the stream is now another one"));
  EXPECT_EQ(recorder_.state().frames, 10);
  EXPECT_EQ(recorded_pictures().size(), 10U);
}

TEST_F(LiveRecorderTest, LeavesOutWhatHasNoPlaceAndCountsIt) {
  ASSERT_EQ(begin(600), LiveRecorder::Begin::kBegun) << error_;
  take(0, 3);
  // More than the queue ever takes.
  Frame lost = kept_frame(3, 100.06, 8192, 8200);
  lost.stamp.restarted = true;
  recorder_.take(lost);
  Frame without = kept_frame(4, 100.08);
  without.coded = nullptr;
  recorder_.take(without);
  take(5, 8);
  EXPECT_TRUE(recorder_.end());
  EXPECT_EQ(recorder_.state().frames, 6);
  EXPECT_EQ(recorder_.state().left_out, 2);
  EXPECT_EQ(recorded_pictures(), (std::vector<std::int64_t>{0, 1, 2, 5, 6, 7}));
  // That a new connection began is said of the first frame after it that is stored.
  const auto recording = open_recorded_frames({recorder_.state().directory, false, false});
  for (int i = 0; i < 6; ++i) {
    Frame frame;
    ASSERT_EQ(recording->read(frame, 0), ReadStatus::kOk);
    EXPECT_EQ(frame.stamp.restarted, i == 3) << i;
  }
}

}  // namespace
}  // namespace alidade
