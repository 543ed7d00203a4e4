#include "platform/storage/recording_writer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>
#include <tuple>

#include "platform/storage/recording.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

FrameStamp some_frame(int i) {
  FrameStamp stamp;
  stamp.frame = i;
  stamp.receive_time_s = 12345.678901234 + i / 3.0;
  stamp.sender_time_s = i / 30.0;
  if (i % 2 == 1) {
    stamp.sender_utc_s = 1.7e9 + i / 7.0;
    stamp.sequence = 1'000'000'007LL * i;
  }
  stamp.restarted = i == 0;
  return stamp;
}

PanTiltSample some_sample(int i) {
  PanTiltSample sample;
  sample.latest_time_s = 12345.1 + i / 3.0;
  sample.earliest_time_s = sample.latest_time_s - 1e-3 / 7;
  sample.pan_rad = -3.0 + i / 11.0;
  sample.tilt_rad = 1e-9 / 3;
  if (i % 2 == 1) {
    sample.zoom = 1234.5;
    sample.device_time_s = 1.0 / (i + 3);
    sample.sequence = i;
  }
  sample.restarted = i == 2;
  return sample;
}

// All members, in their order. A new one does not compile here: some_frame() or some_sample() is to
// give it a value, and a recording to keep it.
auto members_of(const FrameStamp& stamp) {
  // stamped_at is not stored: it stays at its default.
  const auto& [frame, receive_time_s, sender_time_s, sender_utc_s, sequence, restarted,
               stamped_at] = stamp;
  return std::tuple(frame, receive_time_s, sender_time_s, sender_utc_s, sequence, restarted,
                    static_cast<int>(stamped_at));
}

auto members_of(const PanTiltSample& sample) {
  const auto& [earliest_time_s, latest_time_s, pan_rad, tilt_rad, zoom, device_time_s, sequence,
               restarted] = sample;
  return std::tuple(earliest_time_s, latest_time_s, pan_rad, tilt_rad, zoom, device_time_s,
                    sequence, restarted);
}

TEST(RecordingWriter, WritesWhatTheReaderReadsBackToTheLastBit) {
  const TemporaryDirectory directory;
  const std::string path = directory.path() + "/new/recording";
  std::string error;
  RecordingWriter writer;
  ASSERT_TRUE(writer.open(path, 640, 480, "a \"note\"\nof two lines", &error)) << error;
  for (int i = 0; i < 20; ++i) {
    ASSERT_TRUE(writer.add_frame(some_frame(i), &error)) << error;
    ASSERT_TRUE(writer.add_telemetry(some_sample(i), &error)) << error;
  }
  ASSERT_TRUE(writer.flush(&error)) << error;

  // While the writer is still open, as after a kill.
  RecordingInfo info;
  std::vector<FrameStamp> frames;
  std::vector<PanTiltSample> samples;
  ASSERT_TRUE(read_recording_info(path, &info, &error)) << error;
  ASSERT_TRUE(read_frames_csv(path, &frames, &error)) << error;
  ASSERT_TRUE(read_telemetry_csv(path, &samples, &error)) << error;
  EXPECT_EQ(info.width, 640);
  EXPECT_EQ(info.height, 480);
  EXPECT_EQ(info.notes, "a \"note\"\nof two lines");
  ASSERT_EQ(frames.size(), 20U);
  ASSERT_EQ(samples.size(), 20U);
  for (int i = 0; i < 20; ++i) {
    EXPECT_EQ(members_of(frames[static_cast<std::size_t>(i)]), members_of(some_frame(i)));
    EXPECT_EQ(members_of(samples[static_cast<std::size_t>(i)]), members_of(some_sample(i)));
  }
}

TEST(RecordingWriter, RefusesADirectoryThatHoldsARecording) {
  const TemporaryDirectory directory;
  directory.write("frames.csv", "frame,receive_time_s\n0,1\n");
  std::string error;
  RecordingWriter writer;
  EXPECT_FALSE(writer.open(directory.path(), 1, 1, "", &error));
  EXPECT_THAT(error, HasSubstr("frames.csv exists already"));
  std::vector<FrameStamp> frames;
  ASSERT_TRUE(read_frames_csv(directory.path(), &frames, &error)) << error;
  EXPECT_EQ(frames.size(), 1U);
}

TEST(RecordingWriter, WhereItCannotBeginItLeavesNoFileOfItsOwn) {
  const TemporaryDirectory directory;
  const std::string mine = directory.write("telemetry.csv", "somebody's\n");
  std::string error;
  RecordingWriter writer;
  EXPECT_FALSE(writer.open(directory.path(), 1, 1, "", &error));
  EXPECT_THAT(error, HasSubstr("telemetry.csv exists already"));
  EXPECT_FALSE(std::filesystem::exists(directory.path() + "/frames.csv"));
  std::filesystem::remove(mine);
  EXPECT_TRUE(writer.open(directory.path(), 1, 1, "", &error)) << error;
}

TEST(RecordingWriter, SaysThatTheDirectoryCannotBeMade) {
  const TemporaryDirectory directory;
  directory.write("file", "");
  std::string error;
  RecordingWriter writer;
  EXPECT_FALSE(writer.open(directory.path() + "/file/recording", 1, 1, "", &error));
  EXPECT_THAT(error, HasSubstr("cannot make "));
}

// Files that may not grow fail as on a full disk.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    old_handler_ = std::signal(SIGXFSZ, SIG_IGN);
    getrlimit(RLIMIT_FSIZE, &old_);
    rlimit limited = old_;
    limited.rlim_cur = bytes;
    setrlimit(RLIMIT_FSIZE, &limited);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, old_handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit old_{};
  void (*old_handler_)(int) = nullptr;
};

TEST(RecordingWriter, ReportsAFullDiskAndKeepsWholeRows) {
  const TemporaryDirectory directory;
  const std::string path = directory.path() + "/r";
  std::string error;
  std::size_t written = 0;
  RecordingWriter writer;
  ASSERT_TRUE(writer.open(path, 1, 1, "", &error)) << error;
  {
    const FileSizeLimit limit(1000);
    while (written < 1000 && writer.add_frame(some_frame(static_cast<int>(written)), &error)) {
      ++written;
    }
  }
  EXPECT_THAT(error, HasSubstr("cannot write " + path + "/frames.csv: "));
  EXPECT_GT(written, 0U);
  std::vector<FrameStamp> frames;
  ASSERT_TRUE(read_frames_csv(path, &frames, &error)) << error;
  EXPECT_EQ(frames.size(), written);

  // With room again it goes on where it stopped.
  ASSERT_TRUE(writer.add_frame(some_frame(7), &error)) << error;
  ASSERT_TRUE(read_frames_csv(path, &frames, &error)) << error;
  EXPECT_EQ(frames.size(), written + 1);
}

TEST(RecordingWriter, TakesFramesAndTelemetryFromTwoThreads) {
  const TemporaryDirectory directory;
  const std::string path = directory.path() + "/r";
  std::string error;
  RecordingWriter writer;
  ASSERT_TRUE(writer.open(path, 1, 1, "", &error)) << error;
  std::thread telemetry([&writer] {
    std::string telemetry_error;
    for (int i = 0; i < 500; ++i) {
      EXPECT_TRUE(writer.add_telemetry(some_sample(i), &telemetry_error)) << telemetry_error;
    }
  });
  for (int i = 0; i < 500; ++i) {
    EXPECT_TRUE(writer.add_frame(some_frame(i), &error)) << error;
  }
  telemetry.join();
  std::vector<FrameStamp> frames;
  std::vector<PanTiltSample> samples;
  ASSERT_TRUE(read_frames_csv(path, &frames, &error)) << error;
  ASSERT_TRUE(read_telemetry_csv(path, &samples, &error)) << error;
  EXPECT_EQ(frames.size(), 500U);
  EXPECT_EQ(samples.size(), 500U);
}

}  // namespace
}  // namespace alidade
