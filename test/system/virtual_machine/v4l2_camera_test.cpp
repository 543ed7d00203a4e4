// V4L2 on cameras of the kernel: the contract of all sources, and what only V4L2 has. Runs in the
// virtual machine, where the script has loaded
//   $WEBCAM     vivid, webcam input         $HDMI      vivid, HDMI input, 720p at 60 Hz
//   $OUTPUT     vivid, an output            $PLANES    vivid, multi-planar capture
//   $LOOPBACK   v4l2loopback

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <thread>
#include <vector>

#include "platform/system/clock.h"
#include "platform/video/v4l2_device.h"
#include "platform/video/v4l2_source.h"
#include "platform/video/v4l2_stamps.h"
#include "test/platform/video/frame_source_contract.h"
#include "test/system/virtual_machine/kernel_camera.h"

namespace alidade {
namespace {

using ::testing::HasSubstr;

std::string device(const char* variable) {
  const char* name = std::getenv(variable);
  if (name == nullptr) {
    throw std::runtime_error(std::string("the script has not set ") + variable);
  }
  return name;
}

V4l2SourceOptions options_of(const char* variable, V4l2Format format, int width, int height,
                             double rate_hz, double timeout_s = kDeadline_s) {
  V4l2SourceOptions options;
  options.device = device(variable);
  options.wish = {format, width, height, rate_hz};
  options.timeout_s = timeout_s;
  return options;
}

struct V4l2Rig : LiveFrameSourceRig {
  explicit V4l2Rig(V4l2SourceOptions its_options) : options(std::move(its_options)) {
    options.max_backoff_s = 0.05;
    source = open();
  }
  ~V4l2Rig() override {
    if (keeper >= 0) {
      ::close(keeper);
    }
  }
  std::unique_ptr<FrameSource> open() const override { return open_v4l2(options); }
  // A camera that vivid has unplugged comes back when the last one closes it.
  void take_away() override {
    keeper = ::open(options.device.c_str(), O_RDWR);
    check_call(keeper, options.device);
    set_control(options.device, "Disconnect", 1);
  }
  void give_back() override { ::close(std::exchange(keeper, -1)); }
  void set_silent(bool silent) override {
    set_control(options.device, "Percentage of Dropped Buffers", silent ? 100 : 0);
  }
  V4l2SourceOptions options;
  int keeper = -1;
};

// The camera is the program that feeds the device: without it there is none, or silence.
struct LoopbackRig : V4l2Rig {
  explicit LoopbackRig(double timeout_s)
      : V4l2Rig(options_of("LOOPBACK", V4l2Format::kMjpg, 320, 240, 0, timeout_s)) {
    give_back();
  }
  void take_away() override { camera.reset(); }
  void give_back() override {
    camera = std::make_unique<LoopbackCamera>(options.device, 320, 240, 30);
  }
  void set_silent(bool silent) override { camera->silent = silent; }
  std::unique_ptr<LoopbackCamera> camera;
};

template <class Rig>
std::vector<FrameSourceCase<Rig>> cases(double webcam_timeout_s, double loopback_timeout_s) {
  const auto webcam = [webcam_timeout_s](V4l2Format format) {
    return [=] {
      return std::make_unique<V4l2Rig>(options_of("WEBCAM", format, 320, 180, 0, webcam_timeout_s));
    };
  };
  return {
      {"Grey", webcam(V4l2Format::kGrey)},
      {"Nv12", webcam(V4l2Format::kNv12)},
      {"Yuyv", webcam(V4l2Format::kYuyv)},
      {"Uyvy", webcam(V4l2Format::kUyvy)},
      {"Mjpg", [loopback_timeout_s] { return std::make_unique<LoopbackRig>(loopback_timeout_s); }}};
}

const auto name_of = [](const auto& which) { return which.param.name; };

INSTANTIATE_TEST_SUITE_P(V4l2, FrameSourceContract,
                         ::testing::ValuesIn(cases<FrameSourceRig>(kDeadline_s, kDeadline_s)),
                         name_of);
INSTANTIATE_TEST_SUITE_P(V4l2, LiveFrameSourceContract,
                         ::testing::ValuesIn(cases<LiveFrameSourceRig>(kDeadline_s, 1)), name_of);
INSTANTIATE_TEST_SUITE_P(V4l2, PatientFrameSourceContract,
                         ::testing::ValuesIn(cases<LiveFrameSourceRig>(kForever_s, kForever_s)),
                         name_of);

// 60 frames a second, so that little time is spent in waiting; every control back where it was.
class V4l2Camera : public ::testing::Test {
 protected:
  V4l2Camera() { set_control(options_.device, "Timestamp Source", kStartOfExposure); }
  ~V4l2Camera() override {
    source_.reset();
    frame_ = Frame{};
    set_control(options_.device, "Timestamp Source", kStartOfExposure);
    set_control(options_.device, "Percentage of Dropped Buffers", 0);
    set_control(options_.device, "Wrap Sequence Number", 0);
  }
  void open() { source_ = open_v4l2(options_); }
  ReadStatus read() { return read_until(*source_, frame_, ReadStatus::kOk); }

  static constexpr int kEndOfFrame = 0;
  static constexpr int kStartOfExposure = 1;
  V4l2SourceOptions options_ = options_of("WEBCAM", V4l2Format::kGrey, 320, 180, 60);
  std::unique_ptr<FrameSource> source_;
  Frame frame_;
};

TEST_F(V4l2Camera, StampsAndCountsEveryFrameAsTheDriverDoes) {
  open();
  ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
  const FrameStamp first = frame_.stamp;
  EXPECT_TRUE(first.restarted);
  FrameStamp last = first;
  std::int64_t gaps = 0;
  for (int i = 1; i < 120; ++i) {
    ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
    EXPECT_EQ(frame_.stamp.frame, i);
    EXPECT_FALSE(frame_.stamp.restarted);
    ASSERT_TRUE(frame_.stamp.sequence && last.sequence);
    EXPECT_GT(*frame_.stamp.sequence, *last.sequence);
    EXPECT_GT(frame_.stamp.receive_time_s, last.receive_time_s);
    EXPECT_LE(frame_.stamp.receive_time_s, monotonic_now_s());
    EXPECT_FALSE(frame_.stamp.sender_time_s);
    gaps += *frame_.stamp.sequence - *last.sequence - 1;
    last = frame_.stamp;
  }
  EXPECT_EQ(source_->counters().dropped, gaps);
  EXPECT_EQ(source_->counters().damaged, 0);
  // The driver stamps by its clock, which loses nothing where frames are lost.
  const double period_s = (last.receive_time_s - first.receive_time_s) /
                          static_cast<double>(*last.sequence - *first.sequence);
  EXPECT_NEAR(period_s, 1.0 / 60, 1e-3);
}

TEST_F(V4l2Camera, DoesNotPassOnStampsOfTheFuture) {
  set_control(options_.device, "Timestamp Source", kEndOfFrame);
  open();
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
    EXPECT_LE(frame_.stamp.receive_time_s, monotonic_now_s());
  }
}

TEST_F(V4l2Camera, ShowsInjectedLossesInTheSequence) {
  set_control(options_.device, "Percentage of Dropped Buffers", 30);
  open();
  ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
  const std::int64_t first = *frame_.stamp.sequence;
  constexpr int kFrames = 60;
  for (int i = 1; i < kFrames; ++i) {
    ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
  }
  const std::int64_t lost = *frame_.stamp.sequence - first - (kFrames - 1);
  // Of 60 frames that came, 26 are lost on average, with a standard deviation of 6.
  EXPECT_GE(lost, 5);
  EXPECT_EQ(source_->counters().dropped, lost);
}

TEST_F(V4l2Camera, CountsOnWhereTheKernelsNumbersWrap) {
  set_control(options_.device, "Wrap Sequence Number", 1);
  open();
  ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
  std::int64_t last = *frame_.stamp.sequence;
  EXPECT_LT(last, 1LL << 32);
  while (last < (1LL << 32) + 5) {
    ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
    ASSERT_GT(*frame_.stamp.sequence, last);
    ASSERT_FALSE(frame_.stamp.restarted);
    last = *frame_.stamp.sequence;
  }
}

TEST_F(V4l2Camera, LeavesOutAndCountsBuffersWithAnErrorFlag) {
  open();
  ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
  set_control(options_.device, "Inject V4L2_BUF_FLAG_ERROR", 1);
  const double end_s = monotonic_now_s() + kDeadline_s;
  while (source_->counters().damaged == 0 && monotonic_now_s() < end_s) {
    ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
    EXPECT_FALSE(frame_.stamp.restarted);
  }
  EXPECT_EQ(source_->counters().damaged, 1);
}

TEST_F(V4l2Camera, OpensAgainAfterAFatalStreamingError) {
  open();
  ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
  set_control(options_.device, "Inject Fatal Streaming Error", 1);
  ASSERT_EQ(read_until(*source_, frame_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_THAT(source_->error(), HasSubstr(options_.device + ": "));
  const std::int64_t before = frame_.stamp.frame;
  ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
  EXPECT_TRUE(frame_.stamp.restarted);
  EXPECT_EQ(frame_.stamp.frame, before + 1);
}

TEST_F(V4l2Camera, OpensAgainAfterTheCameraWasUnplugged) {
  open();
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
  }
  const std::int64_t before = frame_.stamp.frame;
  frame_ = Frame{};
  // Comes back when the last one who has it open lets go.
  set_control(options_.device, "Disconnect", 1);
  ASSERT_EQ(read_until(*source_, frame_, ReadStatus::kDisconnected), ReadStatus::kDisconnected);
  EXPECT_EQ(source_->error(), options_.device + ": the device is gone");
  ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
  EXPECT_TRUE(frame_.stamp.restarted);
  EXPECT_GT(frame_.stamp.frame, before);
  ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
  EXPECT_FALSE(frame_.stamp.restarted);
}

TEST_F(V4l2Camera, LendsItsBuffersAndNeverStarvesTheDriver) {
  open();
  std::vector<Frame> kept;
  std::vector<std::vector<std::uint8_t>> copies;
  for (int i = 0; i < 20; ++i) {  // more than there are buffers
    ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
    copies.emplace_back(frame_.luma, frame_.luma + 320);
    kept.push_back(frame_);
  }
  const auto intact = [&] {
    for (std::size_t i = 0; i < kept.size(); ++i) {
      EXPECT_EQ(std::memcmp(kept[i].luma, copies[i].data(), 320), 0) << i;
    }
  };
  intact();
  // Given back by another thread while this one reads on.
  std::thread other([few = std::vector<Frame>(kept.begin(), kept.begin() + 10)]() mutable {
    for (Frame& frame : few) {
      frame = Frame{};
    }
  });
  kept.erase(kept.begin(), kept.begin() + 10);
  copies.erase(copies.begin(), copies.begin() + 10);
  for (int i = 0; i < 10; ++i) {
    ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
  }
  other.join();
  source_.reset();
  intact();
  open();  // though some pictures are still out
  EXPECT_EQ(read(), ReadStatus::kOk) << source_->error();
}

// GREY has the full range of values, the others that of video: black and white are what they share.
TEST_F(V4l2Camera, TakesTheSameLumaFromEveryFormat) {
  constexpr int kCheckers = 10;  // of 16x16 px
  constexpr int kNoText = 2;
  set_control(options_.device, "OSD Text Mode", kNoText);
  set_control(options_.device, "Test Pattern", kCheckers);
  std::vector<std::vector<bool>> pictures;
  for (const V4l2Format format :
       {V4l2Format::kGrey, V4l2Format::kNv12, V4l2Format::kYuyv, V4l2Format::kUyvy}) {
    options_.wish.format = format;
    open();
    ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
    std::vector<bool> white;
    for (int v = 0; v < frame_.height; ++v) {
      for (int u = 0; u < frame_.width; ++u) {
        const int luma = frame_.luma[v * frame_.stride + u];
        EXPECT_TRUE(luma <= 20 || luma >= 230) << to_string(format) << " has " << luma;
        white.push_back(luma > 128);
      }
    }
    pictures.push_back(std::move(white));
    frame_ = Frame{};
    source_.reset();
  }
  set_control(options_.device, "OSD Text Mode", 0);
  set_control(options_.device, "Test Pattern", 0);
  const auto whites = std::count(pictures[0].begin(), pictures[0].end(), true);
  EXPECT_GT(whites, 320 * 180 / 3);
  EXPECT_LT(whites, 320 * 180 * 2 / 3);
  for (std::size_t i = 1; i < pictures.size(); ++i) {
    EXPECT_TRUE(pictures[i] == pictures[0]) << i;
  }
}

TEST_F(V4l2Camera, SaysWhatTheDeviceOffers) {
  const auto refusal = [&](V4l2Format format, int width, double rate_hz) {
    options_.wish = {format, width, 360, rate_hz};
    open();
    EXPECT_EQ(source_->read(frame_, kDeadline_s), ReadStatus::kFailed);
    return source_->error();
  };
  EXPECT_THAT(refusal(V4l2Format::kMjpg, 640, 0), HasSubstr(": offers no MJPG; it offers "));
  EXPECT_THAT(refusal(V4l2Format::kGrey, 642, 0),
              HasSubstr(": offers no GREY 642x360; it offers GREY 320x180, 640x360, "));
  EXPECT_THAT(refusal(V4l2Format::kGrey, 640, 1000),
              HasSubstr(": offers no GREY 640x360 at 1000 Hz; it offers GREY "));
}

TEST_F(V4l2Camera, SaysThatAnotherProgramHasTheDevice) {
  open();
  ASSERT_EQ(read(), ReadStatus::kOk) << source_->error();
  const auto second = open_v4l2(options_);
  Frame frame;
  EXPECT_EQ(second->read(frame, kDeadline_s), ReadStatus::kDisconnected);
  EXPECT_THAT(second->error(), HasSubstr(": busy: another program uses it; end that one"));
  source_.reset();
  frame_ = Frame{};
  EXPECT_EQ(read_until(*second, frame, ReadStatus::kOk), ReadStatus::kOk) << second->error();
}

TEST_F(V4l2Camera, SaysWhichGroupMayOpenTheDevice) {
  open();
  constexpr uid_t kNobody = 65534;
  ASSERT_EQ(::seteuid(kNobody), 0);
  const ReadStatus status = source_->read(frame_, kDeadline_s);
  ASSERT_EQ(::seteuid(0), 0);
  EXPECT_EQ(status, ReadStatus::kFailed);
  EXPECT_THAT(source_->error(),
              HasSubstr(": permission denied; the user must be in the group video"));
}

TEST(V4l2Devices, SayThatTheyAreNoCamera) {
  const auto error = [](const std::string& path) {
    V4l2SourceOptions options;
    options.device = path;
    const auto source = open_v4l2(options);
    Frame frame;
    EXPECT_EQ(source->read(frame, kDeadline_s), ReadStatus::kFailed);
    return source->error();
  };
  EXPECT_THAT(error(device("OUTPUT")), HasSubstr(": is no capture device (driver vivid)"));
  EXPECT_THAT(error(device("PLANES")), HasSubstr(": is a multi-planar device (driver vivid)"));
}

TEST(V4l2Devices, OfALoopbackWaitForItsWriter) {
  const V4l2SourceOptions options = options_of("LOOPBACK", V4l2Format::kMjpg, 320, 240, 0);
  const auto source = open_v4l2(options);
  Frame frame;
  ASSERT_EQ(source->read(frame, kDeadline_s), ReadStatus::kDisconnected);
  EXPECT_THAT(source->error(), HasSubstr("no program writes pictures to this loopback device yet"));
  const LoopbackCamera camera(options.device, 320, 240, 30);
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  // Its stamps are of no known clock.
  const double before_s = monotonic_now_s();
  ASSERT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
  EXPECT_LE(frame.stamp.receive_time_s, monotonic_now_s());
  EXPECT_GE(frame.stamp.receive_time_s, before_s);
  const int grey = frame.luma[0];
  EXPECT_LE(std::abs((grey + 5) / 10 * 10 - grey), 2);
}

constexpr double kDuration_s = 8;

struct Throughput {
  std::int64_t frames = 0;
  std::int64_t lost = 0;
};

// What the driver loses on its own shows where buffers go back at once, without a look at them.
Throughput of_the_driver(const V4l2SourceOptions& options) {
  Throughput result;
  const auto plain = std::make_shared<V4l2Device>();
  EXPECT_EQ(plain->open(options.device, options.wish), V4l2Device::Result::kOk) << plain->error();
  V4l2Stamps stamps;
  for (const double end_s = monotonic_now_s() + kDuration_s; monotonic_now_s() < end_s;) {
    V4l2Device::Buffer buffer;
    if (plain->dequeue(&buffer) == V4l2Device::Result::kOk) {
      (void)plain->hold(buffer.index);
      const auto stamp =
          stamps.update(buffer.sequence, buffer.flags, buffer.stamp_s, monotonic_now_s());
      result.frames += stamp.duplicate ? 0 : 1;
      result.lost += stamp.lost;
    } else {
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  }
  return result;
}

Throughput of_the_source(const V4l2SourceOptions& options) {
  Throughput result;
  const auto source = open_v4l2(options);
  Frame frame;
  for (const double end_s = monotonic_now_s() + kDuration_s; monotonic_now_s() < end_s;) {
    EXPECT_EQ(read_until(*source, frame, ReadStatus::kOk), ReadStatus::kOk) << source->error();
    ++result.frames;
  }
  EXPECT_EQ(source->counters().damaged, 0);
  result.lost = source->counters().dropped;
  return result;
}

TEST(V4l2Throughput, IsReported) {
  for (const V4l2Format format : {V4l2Format::kGrey, V4l2Format::kNv12, V4l2Format::kYuyv}) {
    const V4l2SourceOptions options = options_of("HDMI", format, 1280, 720, 60);
    set_control(options.device, "Timestamp Source", 1);
    const Throughput driver = of_the_driver(options);
    const Throughput source = of_the_source(options);
    std::printf(
        "measured: 1280x720 %s at 60 Hz in %.0f s: %lld frames, %lld lost; the driver on its own: "
        "%lld frames, %lld lost\n",
        to_string(format), kDuration_s, static_cast<long long>(source.frames),
        static_cast<long long>(source.lost), static_cast<long long>(driver.frames),
        static_cast<long long>(driver.lost));
    EXPECT_GT(source.frames, 0);
  }
}

}  // namespace
}  // namespace alidade
