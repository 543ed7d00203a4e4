// What every FrameSource promises, run on each of them.

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <ostream>
#include <thread>

#include "platform/video/recording_frame_source.h"
#include "platform/video/rtp_source.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/rtp_sender.h"
#include "test/platform/support/rtsp_server.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

// A source and what it needs to live.
struct Rig {
  virtual ~Rig() = default;
  std::unique_ptr<FrameSource> source;
};

struct RtspRig : Rig {
  explicit RtspRig(const RtspStream& stream) : server(stream, "user", "secret") {
    RtpSourceOptions options;
    options.url = server.url();
    options.user = "user";
    options.password = "secret";
    options.timeout_s = kDeadline_s;
    source = std::make_unique<RtpSource>(options);
  }
  RtspServer server;
};

struct RtpRig : Rig {
  RtpRig() {
    const int port = free_rtp_port();
    RtpSourceOptions options;
    options.url = "rtp://@:" + std::to_string(port);
    options.timeout_s = kDeadline_s;
    source = std::make_unique<RtpSource>(options);
    thread = std::thread([this, port] {
      RtpSender sender(RtpSender::Codec::kMjpeg, port);
      while (!over) {
        sender.send();
        std::this_thread::sleep_for(std::chrono::milliseconds(20));  // the camera's pace
      }
    });
  }
  ~RtpRig() override {
    over = true;
    thread.join();
  }
  std::atomic<bool> over{false};
  std::thread thread;
};

struct RecordingRig : Rig {
  explicit RecordingRig(bool realtime) {
    directory.write("recording.yaml", "format: 1\nwidth: 4\nheight: 2\n");
    std::string rows;
    for (int i = 0; i < 10'000; ++i) {
      rows += std::to_string(i) + "," + std::to_string(i * 0.01) + "\n";
    }
    directory.write("frames.csv", "frame,receive_time_s\n" + rows);
    for (int i = 0; i < 100; ++i) {
      char name[32];
      std::snprintf(name, sizeof name, "frames/%06d.pgm", i);
      directory.write(name, "P5\n4 2\n255\nabcdefgh");
    }
    RecordingFrameSourceOptions options;
    options.directory = directory.path();
    options.realtime = realtime;
    source = std::make_unique<RecordingFrameSource>(options);
  }
  TemporaryDirectory directory;
};

struct Case {
  const char* name;
  std::function<std::unique_ptr<Rig>()> make;
};

void PrintTo(const Case& which, std::ostream* out) { *out << which.name; }

class FrameSourceContract : public ::testing::TestWithParam<Case> {
 protected:
  std::unique_ptr<Rig> rig_ = GetParam().make();
  FrameSource& source_ = *rig_->source;
  Frame frame_;
};

TEST_P(FrameSourceContract, NumbersItsFramesAndGivesEachItsPicture) {
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(read_until(source_, frame_, ReadStatus::kOk), ReadStatus::kOk) << source_.error();
    EXPECT_EQ(frame_.stamp.frame, i);
    EXPECT_GT(frame_.width, 0);
    EXPECT_GT(frame_.height, 0);
    ASSERT_NE(frame_.luma, nullptr);
    EXPECT_GE(frame_.stride, frame_.width);
    EXPECT_NE(frame_.owner, nullptr);
  }
}

TEST_P(FrameSourceContract, LosesNothingWhenAReadDoesNotWait) {
  int frames = 0;
  EXPECT_TRUE(eventually([&] {
    const ReadStatus status = source_.read(frame_, 0);
    EXPECT_TRUE(status == ReadStatus::kOk || status == ReadStatus::kTimeout) << source_.error();
    if (status == ReadStatus::kOk) {
      EXPECT_EQ(frame_.stamp.frame, frames++);
    }
    return frames == 5;
  }));
}

TEST_P(FrameSourceContract, StaysStoppedWhenStoppedBeforeTheFirstRead) {
  source_.stop();
  source_.stop();
  EXPECT_EQ(source_.read(frame_, kDeadline_s), ReadStatus::kStopped);
  EXPECT_EQ(source_.read(frame_, 0), ReadStatus::kStopped);
}

TEST_P(FrameSourceContract, EndsAReadWhenAnotherThreadStopsIt) {
  std::atomic<int> frames{0};
  std::thread reader([&] {
    ReadStatus status = ReadStatus::kOk;
    while (status == ReadStatus::kOk || status == ReadStatus::kTimeout) {
      status = source_.read(frame_, kDeadline_s);
      ++frames;
    }
    // A recording at full speed may be over, or out of pictures, before the stop.
    EXPECT_NE(status, ReadStatus::kDisconnected);
  });
  EXPECT_TRUE(eventually([&] { return frames > 0; }));
  source_.stop();
  reader.join();
  EXPECT_EQ(source_.read(frame_, 0), ReadStatus::kStopped);
}

TEST_P(FrameSourceContract, HasANameWithoutPassword) {
  EXPECT_FALSE(source_.name().empty());
  EXPECT_EQ(source_.name().find("secret"), std::string::npos);
}

INSTANTIATE_TEST_SUITE_P(
    Sources, FrameSourceContract,
    ::testing::Values(Case{"RtspMjpeg", [] { return std::make_unique<RtspRig>(kMjpegStream); }},
                      Case{"RtspH264", [] { return std::make_unique<RtspRig>(kH264Stream); }},
                      Case{"Rtp", [] { return std::make_unique<RtpRig>(); }},
                      Case{"Recording", [] { return std::make_unique<RecordingRig>(false); }},
                      Case{"RecordingInRealTime",
                           [] { return std::make_unique<RecordingRig>(true); }}),
    [](const auto& which) { return which.param.name; });

}  // namespace
}  // namespace alidade
