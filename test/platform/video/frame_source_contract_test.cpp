// What every FrameSource promises, run on each of them.

#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <ostream>
#include <thread>

#include "platform/video/mjpeg_source.h"
#include "platform/video/recording_frame_source.h"
#include "platform/video/rtp_source.h"
#include "test/platform/support/eventually.h"
#include "test/platform/support/mjpeg_server.h"
#include "test/platform/support/open_files.h"
#include "test/platform/support/rtp_sender.h"
#include "test/platform/support/rtsp_server.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

// A source and what it needs to live.
struct Rig {
  virtual ~Rig() = default;
  virtual std::unique_ptr<FrameSource> open() const = 0;
  std::unique_ptr<FrameSource> source;
};

struct RtspRig : Rig {
  explicit RtspRig(const RtspStream& stream) : server(stream, "user", "secret") {
    options.url = server.url();
    options.user = "user";
    options.password = "secret";
    options.timeout_s = kDeadline_s;
    source = open();
  }
  std::unique_ptr<FrameSource> open() const override {
    return std::make_unique<RtpSource>(options);
  }
  RtspServer server;
  RtpSourceOptions options;
};

struct RtpRig : Rig {
  RtpRig() {
    const int port = free_rtp_port();
    options.url = "rtp://@:" + std::to_string(port);
    options.timeout_s = kDeadline_s;
    source = open();
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
  std::unique_ptr<FrameSource> open() const override {
    return std::make_unique<RtpSource>(options);
  }
  RtpSourceOptions options;
  std::atomic<bool> over{false};
  std::thread thread;
};

struct MjpegRig : Rig {
  MjpegRig() {
    options.url = server.url();
    options.user = MjpegServer::kUser;
    options.password = "secret";
    options.timeout_s = kDeadline_s;
    source = open();
  }
  ~MjpegRig() override { source.reset(); }  // before the server, which waits for it
  std::unique_ptr<FrameSource> open() const override {
    return std::make_unique<MjpegSource>(options);
  }
  MjpegServer server;
  MjpegSourceOptions options;
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
    options.directory = directory.path();
    options.realtime = realtime;
    source = open();
  }
  std::unique_ptr<FrameSource> open() const override {
    return std::make_unique<RecordingFrameSource>(options);
  }
  TemporaryDirectory directory;
  RecordingFrameSourceOptions options;
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

TEST_P(FrameSourceContract, LeaksNoFileDescriptorOverAThousandLives) {
  rig_->source.reset();
  const auto one_life = [&](double timeout_s) {
    const std::unique_ptr<FrameSource> source = rig_->open();
    const ReadStatus status = source->read(frame_, timeout_s);
    EXPECT_NE(status, ReadStatus::kFailed) << source->error();
    frame_ = Frame{};
  };
  one_life(1);  // what stays open for good
  const auto before = open_files();
  for (int i = 0; i < 1000; ++i) {
    one_life(i % 250 == 0 ? 1 : 0);  // most end in the middle of connecting
  }
  // The rig's server, in this process, has its own ends; it notices their closing in time.
  EXPECT_TRUE(eventually([&] { return open_files() <= before; })) << open_files() - before;
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
                      Case{"Mjpeg", [] { return std::make_unique<MjpegRig>(); }},
                      Case{"Recording", [] { return std::make_unique<RecordingRig>(false); }},
                      Case{"RecordingInRealTime",
                           [] { return std::make_unique<RecordingRig>(true); }}),
    [](const auto& which) { return which.param.name; });

}  // namespace
}  // namespace alidade
