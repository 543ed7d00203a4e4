// The threads of `alidade run` between scripted sources and a collecting sink: losses, returns, ends.

#include "edge_app/pipeline/pipeline.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <thread>

#include "platform/system/clock.h"
#include "test/edge_app/pipeline/scripted_sources.h"
#include "test/platform/support/eventually.h"
#include "test/support/fresh_memory.h"

namespace alidade {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

PipelineOptions options_for_tests() {
  PipelineOptions options;
  options.step.calibration.camera.focal_length = 30000;
  options.step.calibrated = true;
  return options;
}

class PipelineTest : public ::testing::Test {
 protected:
  // As in the program, the log exists before there are threads: the thread sanitizer does not see
  // how the library, which it has not instrumented, guards the first use.
  PipelineTest() { static_cast<void>(spdlog::default_logger_raw()); }

  // A frame received now.
  Frame frame() {
    Frame frame;
    frame.stamp.frame = next_frame_++;
    frame.stamp.receive_time_s = monotonic_now_s();
    frame.width = 1920;
    frame.height = 1080;
    return frame;
  }

  // The head turns at a constant rate from the beginning of the test.
  [[nodiscard]] double pan(double time_s) const { return 0.1 * (time_s - start_s_); }

  // Two samples about now: enough for an orientation of frames of the next quarter of a second.
  void push_telemetry(bool restarted = false) {
    const double now = monotonic_now_s();
    for (const double age : {0.02, 0.0}) {
      PanTiltSample sample;
      sample.latest_time_s = now - age;
      sample.earliest_time_s = sample.latest_time_s - 0.001;
      sample.pan_rad = pan(now - age - 0.0005);  // the middle of the interval
      sample.restarted = restarted && age > 0;
      pan_tilt_.push(sample);
    }
  }

  // The record of a frame pushed now.
  OrientationRecord next_record() {
    const Frame pushed = frame();
    video_.push(pushed);
    const auto of_frame = [&](const OrientationRecord& record) {
      return record.frame == pushed.stamp.frame;
    };
    const std::vector<OrientationRecord> records = sink_.wait_until(
        [&](const auto& so_far) { return std::any_of(so_far.begin(), so_far.end(), of_frame); });
    const auto found = std::find_if(records.begin(), records.end(), of_frame);
    if (found != records.end()) return *found;
    ADD_FAILURE() << "no record of frame " << pushed.stamp.frame;
    return {};
  }

  // Pushes telemetry and frames until a record says `status`: the two have queues of their own, so
  // that which arrives first is open.
  OrientationRecord push_until(RecordStatus status) {
    for (int attempt = 0; attempt < 1000 && !HasFailure(); ++attempt) {
      push_telemetry();
      const OrientationRecord record = next_record();
      if (record.status == status) return record;
    }
    ADD_FAILURE() << "no record said " << to_string(status);
    return {};
  }

  // Waits for the news of a loss.
  OrientationRecord wait_for(RecordStatus status, std::size_t count = 1) {
    const auto says = [status](const OrientationRecord& record) { return record.status == status; };
    const auto enough = [&](const std::vector<OrientationRecord>& records) {
      return static_cast<std::size_t>(std::count_if(records.begin(), records.end(), says)) >= count;
    };
    const std::vector<OrientationRecord> records = sink_.wait_until(enough);
    EXPECT_TRUE(enough(records)) << "no record said " << to_string(status);
    return records.empty() ? OrientationRecord() : records.back();
  }

  static bool finished(const Pipeline& pipeline) {
    pollfd descriptor{pipeline.finished_fd(), POLLIN, 0};
    return ::poll(&descriptor, 1, 60000) == 1;
  }
  static bool finished_now(const Pipeline& pipeline) {
    pollfd descriptor{pipeline.finished_fd(), POLLIN, 0};
    return ::poll(&descriptor, 1, 0) == 1;
  }

  ScriptedVideo video_{"rtsp://camera/stream"};
  ScriptedPanTilt pan_tilt_{"http://camera"};
  CollectingSink sink_;
  std::int64_t next_frame_ = 0;
  const double start_s_ = monotonic_now_s();
};

TEST_F(PipelineTest, GivesOneRecordAFrameInTheirOrder) {
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options_for_tests());
  pipeline.start();
  for (int i = 0; i < 100; ++i) video_.push(frame());
  video_.push(ReadStatus::kEnd);
  ASSERT_TRUE(finished(pipeline));
  pipeline.stop();
  const std::vector<OrientationRecord> records = sink_.records();
  ASSERT_EQ(records.size(), 100U);
  for (std::size_t i = 0; i < records.size(); ++i) {
    EXPECT_EQ(records[i].frame, static_cast<std::int64_t>(i));
    EXPECT_GT(*records[i].latency_s, 0);
  }
  EXPECT_EQ(pipeline.error(), "");
  EXPECT_EQ(pipeline.summary().frames, 100);
  EXPECT_EQ(pipeline.summary().drops.total(), 0);
  EXPECT_GT(pipeline.summary().latency.quantile(0.5), 0);
}

TEST_F(PipelineTest, GivesAnOrientationFromTheTelemetryOfItsTime) {
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options_for_tests());
  pipeline.start();
  const OrientationRecord record = push_until(RecordStatus::kOk);
  EXPECT_EQ(record.mode, RecordMode::kPt);
  EXPECT_TRUE(record.calibrated);
  ASSERT_TRUE(record.orientation);
  EXPECT_NEAR(record.orientation->pan_rad, pan(*record.time_s), 1e-6);
  pipeline.stop();
  EXPECT_EQ(pipeline.error(), "");
}

// An image that nobody has touched is a page fault a page to the thread that looks at it first.
TEST_F(PipelineTest, CountsThePageFaultsOfTheRealtimeThread) {
  constexpr std::size_t kPage = 4096;
  PipelineOptions options = options_for_tests();
  Camera<double>& camera = options.step.calibration.camera;
  camera.width = 1280;
  camera.height = 720;
  options.step.calibrated = false;
  options.step.oe = OeOptions();
  options.step.follow_points = true;  // whatever is known of the camera's angle
  const test::FreshMemory image(static_cast<std::size_t>(camera.width) *
                                static_cast<std::size_t>(camera.height));
  Frame unseen = frame();
  unseen.width = camera.width;
  unseen.height = camera.height;
  unseen.stride = camera.width;
  unseen.luma = reinterpret_cast<const std::uint8_t*>(image.data());
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options);
  pipeline.start();
  video_.push(unseen);
  video_.push(ReadStatus::kEnd);
  ASSERT_TRUE(finished(pipeline));
  pipeline.stop();
  EXPECT_GE(pipeline.summary().page_faults.minor, static_cast<long>(image.size() / kPage));
}

// The camera counts 2 % more than it takes pictures. Time is what the stamps say: the test waits for nothing.
TEST_F(PipelineTest, SumsUpThatTimeStampsAreLeftOut) {
  PipelineOptions options = options_for_tests();
  options.step.wait_for_pace = true;
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options);
  pipeline.start();
  for (int i = 0; i < 1200; ++i) {
    Frame counted = frame();
    counted.stamp.receive_time_s = 0.04 * i;
    counted.stamp.sender_time_s = 1.02 * counted.stamp.receive_time_s;
    counted.stamp.restarted = i == 0;
    video_.push(counted);
    // No more than the queues hold.
    if (i % 100 == 99) {
      const auto enough = static_cast<std::size_t>(i + 1);
      sink_.wait_until([enough](const auto& so_far) { return so_far.size() >= enough; });
    }
  }
  const std::vector<OrientationRecord> records = sink_.records();
  ASSERT_EQ(records.size(), 1200U);
  pipeline.stop();
  ASSERT_TRUE(pipeline.summary().stamps_left_out);
  EXPECT_NEAR(*pipeline.summary().stamps_left_out, 0.02, 1e-4);
  EXPECT_EQ(records[0].status, RecordStatus::kTimeUnknown);
  EXPECT_NE(records[1199].status, RecordStatus::kTimeUnknown);
}

TEST_F(PipelineTest, SaysNoneWhileTheVideoIsAwayAndGoesOnWhenItIsBack) {
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options_for_tests());
  pipeline.start();
  static_cast<void>(push_until(RecordStatus::kOk));
  video_.push(ReadStatus::kDisconnected, "rtsp://camera/stream: connection refused");
  // At the loss, and then each second.
  const OrientationRecord lost = wait_for(RecordStatus::kVideoLost, 2);
  EXPECT_EQ(lost.mode, RecordMode::kNone);
  EXPECT_FALSE(lost.frame);
  const LinkHealth away = pipeline.summary().video_link;
  EXPECT_FALSE(away.connected);
  EXPECT_EQ(away.reason, video_.error());
  EXPECT_EQ(away.reconnections, 0);
  EXPECT_TRUE(pipeline.summary().pan_tilt_link.connected);
  const OrientationRecord back = push_until(RecordStatus::kOk);
  EXPECT_TRUE(pipeline.summary().video_link.connected);
  EXPECT_EQ(pipeline.summary().video_link.reconnections, 1);
  EXPECT_TRUE(back.orientation);
  EXPECT_FALSE(finished_now(pipeline));
  pipeline.stop();
  EXPECT_EQ(pipeline.error(), "");
}

TEST_F(PipelineTest, SaysThatTheTelemetryIsLostAndGoesOnWhenItIsBack) {
  PipelineOptions options = options_for_tests();
  options.step.telemetry_limits.max_extrapolation_s = 0;
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options);
  pipeline.start();
  pan_tilt_.push(ReadStatus::kDisconnected, "http://camera: connection refused");
  for (bool lost = false; !lost && !HasFailure();) {
    const OrientationRecord record = next_record();
    EXPECT_EQ(record.mode, RecordMode::kNone);
    lost = record.status == RecordStatus::kTelemetryLost;
  }
  push_telemetry(true);
  static_cast<void>(push_until(RecordStatus::kTelemetryTooOld));  // connected: no longer "lost"
  EXPECT_FALSE(finished_now(pipeline));
  pipeline.stop();
}

TEST_F(PipelineTest, SaysFromTheFirstRecordOnWhetherItCalibrates) {
  for (const bool automatic : {true, false}) {
    SelfCalibrationOptions calibrating;
    calibrating.automatic = automatic;
    SelfCalibration calibration(calibrating, nullptr);
    CollectingSink sink;
    ScriptedVideo video("rtsp://camera/stream");
    ScriptedPanTilt pan_tilt("http://camera");
    Pipeline pipeline(video, pan_tilt, sink, &calibration, options_for_tests());
    pipeline.start();
    video.push(frame());
    const auto records = sink.wait_until([](const auto& so_far) { return !so_far.empty(); });
    ASSERT_FALSE(records.empty());
    EXPECT_EQ(records[0].calibration.activity,
              automatic ? CalibrationActivity::kCollecting : CalibrationActivity::kOff);
    pipeline.stop();
  }
}

TEST_F(PipelineTest, ShowsAImageToWhoAsksAndLetsGoOfItAtTheEnd) {
  constexpr std::size_t kWidth = 1280;
  constexpr std::size_t kHeight = 720;
  const auto luma = std::make_shared<std::vector<std::uint8_t>>(kWidth * kHeight, 128);
  ImageTap tap(std::chrono::milliseconds(0));
  PipelineOptions options = options_for_tests();
  options.tap = &tap;
  {
    Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options);
    pipeline.start();
    std::atomic<bool> seen{false};
    std::thread viewer([&] {
      for (std::int64_t last = -1; last < 5;) {
        const auto image = tap.ask(std::chrono::seconds(60));
        ASSERT_NE(image, nullptr);
        EXPECT_GT(image->frame, last);
        EXPECT_FALSE(image->jpeg.empty());
        EXPECT_EQ(image->width, 1280);
        last = image->frame;
      }
      seen = true;
      while (tap.ask(std::chrono::seconds(60)) != nullptr) {
      }
    });
    while (!seen && !HasFailure()) {
      Frame pushed = frame();
      pushed.width = kWidth;
      pushed.height = kHeight;
      pushed.stride = kWidth;
      pushed.luma = luma->data();
      pushed.owner = luma;
      const std::size_t records = sink_.records().size();
      video_.push(pushed);
      sink_.wait_until([&](const auto& so_far) { return so_far.size() > records; });
    }
    pipeline.stop();
    viewer.join();
  }
  EXPECT_EQ(luma.use_count(), 1);
}

// The SCHED_FIFO priority of the calling thread; 0: it has none.
int own_priority() {
  int policy = -1;
  sched_param parameters{};
  pthread_getschedparam(pthread_self(), &policy, &parameters);
  return policy == SCHED_FIFO ? parameters.sched_priority : 0;
}

// Those that the calling thread may run on.
std::vector<int> own_processors() {
  cpu_set_t set;
  std::vector<int> processors;
  if (sched_getaffinity(0, sizeof set, &set) != 0) return processors;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(static_cast<unsigned>(cpu), &set)) processors.push_back(cpu);
  }
  return processors;
}

// Keeps who called.
template <typename Interface, typename Item>
class WatchedSource final : public Interface {
 public:
  ReadStatus read(Item& item, double timeout_s) override {
    priorities_.push_back(own_priority());
    processors_ = own_processors();
    return source_.read(item, timeout_s);
  }
  void stop() override { source_.stop(); }
  [[nodiscard]] std::string error() const override { return source_.error(); }
  [[nodiscard]] std::string name() const override { return source_.name(); }

  ScriptedSource<Interface, Item> source_{"watched"};
  std::vector<int> priorities_;  // of each read
  std::vector<int> processors_;  // of the last read
};

class WatchedSink final : public RecordSink {
 public:
  [[nodiscard]] bool write(const OrientationRecord&) override {
    processors_ = own_processors();
    priority_ = own_priority();
    return true;
  }
  void interrupt() override {}
  [[nodiscard]] std::string error() const override { return ""; }

  std::vector<int> processors_;
  std::atomic<int> priority_{-1};  // of the last write; -1: none yet
};

TEST_F(PipelineTest, GivesAllOnARecordsWayTheirPlaceBelowTheRealtimeThread) {
  constexpr int kPriority = 30;
  bool permitted = false;
  std::thread([&] { permitted = apply_realtime({kPriority, -1, false}).warnings.empty(); }).join();
  if (!permitted) GTEST_SKIP() << "not permitted to have a priority";
  WatchedSource<FrameSource, Frame> video;
  WatchedSource<PanTiltSource, PanTiltSample> pan_tilt;
  WatchedSink sink;
  PipelineOptions options = options_for_tests();
  options.realtime.priority = kPriority;
  Pipeline pipeline(video, pan_tilt, sink, nullptr, options);
  pipeline.start();
  video.source_.push(frame());
  EXPECT_TRUE(eventually([&] { return sink.priority_ >= 0; }));
  video.source_.push(frame());
  EXPECT_TRUE(eventually([&] { return pipeline.summary().frames == 2; }));
  pipeline.stop();
  // What the first read starts goes before decoding.
  EXPECT_EQ(video.priorities_.front(), priority_of(ThreadDuty::kBrief, kPriority));
  EXPECT_EQ(video.priorities_.back(), priority_of(ThreadDuty::kDecoding, kPriority));
  EXPECT_EQ(pan_tilt.priorities_.back(), priority_of(ThreadDuty::kBrief, kPriority));
  EXPECT_EQ(sink.priority_, priority_of(ThreadDuty::kBrief, kPriority));
}

// To wake a processor takes longer than all that they do; where images are looked at, decoding has one of its own.
TEST_F(PipelineTest, PutsThemOnOneProcessorInPtModeOnly) {
  constexpr int kPriority = 30;
  bool permitted = false;
  std::thread([&] { permitted = apply_realtime({kPriority, -1, false}).warnings.empty(); }).join();
  const std::vector<int> all = own_processors();
  for (const int priority : {0, kPriority}) {
    for (const bool oe : {false, true}) {
      for (const int chosen : {-1, all.back()}) {
        WatchedSource<FrameSource, Frame> video;
        WatchedSource<PanTiltSource, PanTiltSample> pan_tilt;
        WatchedSink sink;
        PipelineOptions options = options_for_tests();
        options.realtime.priority = priority;
        options.realtime.cpu = chosen;
        options.step.calibration.camera.width = 64;
        options.step.calibration.camera.height = 48;
        if (oe) options.step.oe.emplace();
        Pipeline pipeline(video, pan_tilt, sink, nullptr, options);
        pipeline.start();
        video.source_.push(frame());
        EXPECT_TRUE(eventually([&] { return sink.priority_ >= 0; }));
        pipeline.stop();
        SCOPED_TRACE(testing::Message() << priority << ' ' << oe << ' ' << chosen);
        if (oe || priority == 0 || !permitted) {
          EXPECT_EQ(sink.processors_, all);
        } else {
          ASSERT_EQ(sink.processors_.size(), 1U);
          if (chosen >= 0) {
            EXPECT_EQ(sink.processors_[0], chosen);
          }
        }
        EXPECT_EQ(video.processors_, sink.processors_);
        EXPECT_EQ(pan_tilt.processors_, sink.processors_);
      }
    }
  }
}

TEST_F(PipelineTest, StopEndsSourcesThatGiveNothing) {
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options_for_tests());
  pipeline.start();
  pipeline.stop();
  EXPECT_TRUE(sink_.records().empty());
  EXPECT_EQ(pipeline.error(), "");
}

TEST_F(PipelineTest, LivesWithoutCameraAndHeadAndNotWithAReaderThatStalls) {
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options_for_tests());
  const auto lives = [&] { return pipeline.pulse_is_answered(); };
  pipeline.start();
  pipeline.ask_for_pulse();
  EXPECT_TRUE(eventually(lives)) << "before anything has come";
  video_.push(ReadStatus::kDisconnected, "rtsp://camera/stream: refused");
  pan_tilt_.push(ReadStatus::kDisconnected, "http://camera: refused");
  wait_for(RecordStatus::kVideoLost);
  pipeline.ask_for_pulse();
  EXPECT_TRUE(eventually(lives)) << "while both are lost";

  sink_.hold(true);
  video_.push(frame());
  ASSERT_TRUE(eventually([&] { return pipeline.summary().frames > 0; }));
  pipeline.ask_for_pulse();
  // The real-time thread has long passed it on when it has filled the queue of records.
  ASSERT_TRUE(eventually([&] {
    for (int i = 0; i < 100; ++i) video_.push(frame());
    return pipeline.summary().drops.records > 0;
  }));
  EXPECT_FALSE(lives()) << "while no record is taken";
  sink_.hold(false);
  EXPECT_TRUE(eventually(lives)) << "once records are taken again";
  pipeline.stop();
}

TEST_F(PipelineTest, StopEndsAPipelineWhoseReaderHasStalled) {
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options_for_tests());
  sink_.hold(true);
  pipeline.start();
  for (int i = 0; i < 3000; ++i) video_.push(frame());
  pipeline.stop();
  const PipelineSummary summary = pipeline.summary();
  EXPECT_EQ(pipeline.error(), "");
  // What did not fit into the queues is counted, and nothing else is missing.
  EXPECT_EQ(static_cast<std::size_t>(summary.records), sink_.records().size());
}

TEST_F(PipelineTest, FinishesWithTheErrorOfASourceThatFailed) {
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options_for_tests());
  pipeline.start();
  pan_tilt_.push(ReadStatus::kFailed, "http://camera: wrong user or password (401)");
  ASSERT_TRUE(finished(pipeline));
  pipeline.stop();
  EXPECT_EQ(pipeline.error(), "http://camera: wrong user or password (401)");
}

class PipelineOfAnotherSizeTest : public PipelineTest {
 protected:
  std::string error_of(const PipelineOptions& options) {
    Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options);
    pipeline.start();
    video_.push(frame());
    EXPECT_TRUE(finished(pipeline));
    pipeline.stop();
    EXPECT_TRUE(sink_.records().empty());
    return pipeline.error();
  }

  PipelineOptions options_of_720_rows() {
    PipelineOptions options = options_for_tests();
    options.width = 1280;
    options.height = 720;
    return options;
  }
};

TEST_F(PipelineOfAnotherSizeTest, FinishesWhenFramesAreNotOfTheCalibrationsSize) {
  PipelineOptions options = options_of_720_rows();
  options.calibration_name = "calibration.yaml";
  options.step.calibrated = true;
  EXPECT_THAT(error_of(options),
              AllOf(HasSubstr("1920x1080"), HasSubstr("1280x720"), HasSubstr("calibration.yaml")));
}

TEST_F(PipelineOfAnotherSizeTest, FinishesWhenFramesAreNotOfTheConfiguredSizeAndNamesItsKeys) {
  PipelineOptions options = options_of_720_rows();
  options.calibration_name = "data sheet";
  options.step.calibrated = false;
  EXPECT_THAT(error_of(options),
              HasSubstr("frames of 1920x1080 px, but video.width and "
                        "video.height are 1280 and 720; set them to 1920 and 1080"));
}

// Whoever stands between camera and program can send a picture.
TEST_F(PipelineOfAnotherSizeTest, RefusesALinkWhosePicturesChangeTheirSizeAndGoesOnWhenItIsRight) {
  PipelineOptions options = options_for_tests();
  options.width = frame().width;
  options.height = frame().height;
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options);
  pipeline.start();
  static_cast<void>(push_until(RecordStatus::kOk));
  Frame other = frame();
  other.width = 640;
  // One in mid-stream, and again behind each reconnection.
  for (int i = 0; i < 3; ++i) video_.push(other);
  static_cast<void>(wait_for(RecordStatus::kVideoLost, 1));
  EXPECT_FALSE(finished_now(pipeline));
  const LinkHealth refused = pipeline.summary().video_link;
  EXPECT_FALSE(refused.connected);
  EXPECT_THAT(refused.reason, HasSubstr("frames of 640x1080 px, but"));
  EXPECT_EQ(refused.reconnections, 0);
  static_cast<void>(push_until(RecordStatus::kOk));
  EXPECT_TRUE(pipeline.summary().video_link.connected);
  pipeline.stop();
  EXPECT_EQ(pipeline.error(), "");
}

TEST_F(PipelineTest, FinishesWithoutAnErrorWhenTheReaderGoes) {
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options_for_tests());
  sink_.close("");
  pipeline.start();
  video_.push(frame());
  ASSERT_TRUE(finished(pipeline));
  pipeline.stop();
  EXPECT_EQ(pipeline.error(), "");
}

TEST_F(PipelineTest, FinishesWithTheErrorOfASinkThatFailed) {
  Pipeline pipeline(video_, pan_tilt_, sink_, nullptr, options_for_tests());
  sink_.close("stdout: cannot write a record: No space left on device");
  pipeline.start();
  video_.push(frame());
  ASSERT_TRUE(finished(pipeline));
  pipeline.stop();
  EXPECT_EQ(pipeline.error(), "stdout: cannot write a record: No space left on device");
}

}  // namespace
}  // namespace alidade
