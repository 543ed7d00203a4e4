// What the real-time thread runs: it allocates nothing, counts what a full queue loses, and ends after the
// last message.

#include "edge_app/pipeline/realtime_stage.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <new>
#include <thread>
#include <vector>

#include "platform/system/clock.h"
#include "platform/system/realtime.h"
#include "test/support/allocation_guard.h"
#include "test/support/fresh_memory.h"

namespace alidade {
namespace {

VideoMessage frame_message(std::int64_t frame) {
  VideoMessage message;
  message.stamp.frame = frame;
  message.stamp.receive_time_s = monotonic_now_s();
  return message;
}

TelemetryMessage sample_message(double pan_rad) {
  TelemetryMessage message;
  message.sample.latest_time_s = monotonic_now_s();
  message.sample.earliest_time_s = message.sample.latest_time_s - 1e-3;
  message.sample.pan_rad = pan_rad;
  return message;
}

int count_records(RealtimeStage* stage) {
  OutputMessage message;
  int count = 0;
  while (stage->pop(message)) ++count;
  return count;
}

// The queues are large: on the heap, once.
std::unique_ptr<RealtimeStage> make_stage() {
  OrientationStepOptions options;
  options.calibration.camera.focal_length = 30000;
  return std::make_unique<RealtimeStage>(options, true, false);
}

TEST(RealtimeStage, CountsWhatFullQueuesLose) {
  const auto stage = make_stage();
  for (int i = 0; i < 300; ++i) stage->push(frame_message(i));
  for (int i = 0; i < 1100; ++i) stage->push(sample_message(0.001 * i));
  EXPECT_EQ(stage->drops().frames, 300 - 256);
  EXPECT_EQ(stage->drops().telemetry, 1100 - 1024);
  EXPECT_TRUE(stage->process());
  EXPECT_EQ(count_records(stage.get()), 256);
  // Nobody takes the records: one filling is in the queue of 256.
  for (int filling = 0; filling < 5; ++filling) {
    for (int i = 0; i < 256; ++i) stage->push(frame_message(i));
    EXPECT_TRUE(stage->process());
  }
  EXPECT_EQ(stage->drops().records, 4 * 256);
}

TEST(RealtimeStage, EndsBehindTheLastMessage) {
  const auto stage = make_stage();
  stage->push(frame_message(0));
  stage->end_input();
  EXPECT_FALSE(stage->output_ended());
  EXPECT_FALSE(stage->process());
  EXPECT_TRUE(stage->output_ended());
  EXPECT_EQ(count_records(stage.get()), 1);
}

TEST(RealtimeStage, PassesOnThePulseThatBothThreadsMustAnswer) {
  const auto stage = make_stage();
  stage->ask_for_pulse();
  stage->answer_pulse();
  EXPECT_FALSE(stage->pulse_is_answered()) << "the real-time thread hangs";
  EXPECT_TRUE(stage->process());
  EXPECT_FALSE(stage->pulse_is_answered()) << "the output thread hangs";
  stage->wait_output();
  stage->answer_pulse();
  EXPECT_TRUE(stage->pulse_is_answered());
  stage->ask_for_pulse();
  EXPECT_FALSE(stage->pulse_is_answered()) << "an old answer is none";
}

// Every kind of message, fed by two other threads as in the pipeline, while the guard watches this one. The
// feeders take turns, so that each frame has its telemetry however they are scheduled.
TEST(RealtimeStage, AllocatesNothing) {
  constexpr int kRounds = 1000;
  const auto stage = make_stage();
  std::atomic<int> frames{0};
  std::atomic<int> samples{0};
  std::thread capture([&] {
    for (int i = 0; i < kRounds; ++i) {
      while (samples <= i) std::this_thread::yield();
      VideoMessage message = frame_message(i);
      if (i % 3 == 0) message.stamp.sender_time_s = 0.04 * i;
      if (i % 3 == 1) message.stamp.sequence = i;
      message.stamp.restarted = i % 100 == 0;
      if (i % 50 == 49) message.kind = VideoMessage::Kind::kLost;
      stage->push(message);
      ++frames;
    }
    stage->end_input();
  });
  std::thread telemetry([&] {
    for (int i = 0; i < kRounds; ++i) {
      while (frames < i) std::this_thread::yield();
      TelemetryMessage message = sample_message(0.001 * (i % 1000));
      if (i % 1000 > 500) message.sample.sequence = i;
      message.sample.restarted = i % 700 == 0;
      if (i % 60 == 59) message.kind = TelemetryMessage::Kind::kLost;
      stage->push(message);
      ++samples;
    }
  });
  std::int64_t records = 0;
  std::int64_t with_orientation = 0;
  {
    const test::AllocationGuard guard;
    bool more = true;
    while (more) {
      stage->wait();
      more = stage->process();
      OutputMessage message;
      while (stage->pop(message)) {
        ++records;
        if (message.record.orientation) ++with_orientation;
      }
    }
    EXPECT_EQ(guard.count(), 0);
  }
  capture.join();
  telemetry.join();
  EXPECT_EQ(records, kRounds - stage->drops().frames - stage->drops().records);
  EXPECT_GT(with_orientation, 0);
}

// As many frames as the queues hold: each is written into memory that was not used before.
TEST(RealtimeStage, TouchesItsQueuesBeforehand) {
  if (!test::kOwnMemoryOnly) GTEST_SKIP() << "the sanitizer touches memory too";
  constexpr std::size_t kPage = 4096;
  constexpr int kFrames = 200;
  constexpr int kBeforehand = 10;  // to bring in the code
  const test::FreshMemory memory(sizeof(RealtimeStage));
  OrientationStepOptions options;
  options.calibration.camera.focal_length = 30000;
  auto* const stage = new (memory.data()) RealtimeStage(options, true, true);
  const auto process = [stage](int from, int to) {
    for (int i = from; i < to; ++i) {
      stage->push(sample_message(0.001 * i));
      stage->push(frame_message(i));
      EXPECT_TRUE(stage->process());
    }
  };
  process(0, kBeforehand);
  const PageFaults before = thread_page_faults();
  process(kBeforehand, kFrames);
  const PageFaults after = thread_page_faults();
  FeedFrame heard;
  int count = 0;
  while (stage->pop(heard)) ++count;
  stage->~RealtimeStage();
  EXPECT_EQ(count, kFrames);
  // Untouched, these frames alone would take so many; the kernel may have reasons of its own for some.
  constexpr long kUntouched = (kFrames - kBeforehand) * sizeof(FeedFrame) / kPage;
  EXPECT_LT(after.minor - before.minor, kUntouched / 4);
}

// Blocks of random brightness, which shift with the frame: something to follow, and to make a map of.
class Scene {
 public:
  static constexpr int kWidth = 320;
  static constexpr int kHeight = 240;

  Scene() : pixels_(static_cast<std::size_t>(kSide * kSide)) {
    std::uint32_t state = 1;
    for (int row = 0; row < kSide; row += kBlock) {
      for (int column = 0; column < kSide; column += kBlock) {
        state = state * 1664525U + 1013904223U;
        for (int i = 0; i < kBlock * kBlock; ++i) {
          pixels_[static_cast<std::size_t>((row + i / kBlock) * kSide + column + i % kBlock)] =
              static_cast<std::uint8_t>(40 + (state >> 25));
        }
      }
    }
  }
  [[nodiscard]] ImageView image(int frame) const {
    const int shift = frame % 64;
    return {pixels_.data() + shift * kSide + shift, kWidth, kHeight, kSide};
  }

 private:
  static constexpr int kSide = 480;
  static constexpr int kBlock = 6;
  std::vector<std::uint8_t> pixels_;
};

OrientationStepOptions options_with_images() {
  OrientationStepOptions options;
  options.calibration.camera = {2000, 1, {0}, Scene::kWidth, Scene::kHeight};
  options.oe.emplace();
  options.oe->maker.cell_size_px = 20;
  options.follow_points = true;
  return options;
}

VideoMessage image_message(const Scene& scene, int frame, ImageSlot slot) {
  VideoMessage message = frame_message(frame);
  message.stamp.sequence = frame;
  message.image = scene.image(frame);
  message.slot = slot;
  // Not late, however slow the machine.
  message.decoded_s = monotonic_now_s() + 1e3;
  return message;
}

TEST(RealtimeStage, GivesEachImageBackOnceAndLendsTheOneThatIsWanted) {
  const Scene scene;
  const auto stage = std::make_unique<RealtimeStage>(options_with_images(), true, true);
  for (ImageSlot slot = 0; slot < 3; ++slot) stage->push(image_message(scene, slot, slot));
  stage->want_image();
  EXPECT_TRUE(stage->process());
  FeedFrame fed;
  ASSERT_TRUE(stage->pop(fed));
  EXPECT_EQ(fed.slot, 0) << "the first frame after the wish";
  EXPECT_TRUE(fed.image.valid());
  EXPECT_EQ(fed.tracks.stamp.frame, 0);
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(stage->pop(fed));
    EXPECT_EQ(fed.slot, kNoImageSlot) << "one wish, one picture";
  }
  ImageSlot slot = kNoImageSlot;
  ASSERT_TRUE(stage->pop_returned(slot));
  EXPECT_EQ(slot, 1);
  ASSERT_TRUE(stage->pop_returned(slot));
  EXPECT_EQ(slot, 2);
  EXPECT_FALSE(stage->pop_returned(slot)) << "the lent one is still looked at";
  stage->give_back(0);
  ASSERT_TRUE(stage->pop_returned(slot));
  EXPECT_EQ(slot, 0);
}

// The calibration thread is busy: what it cannot be told of it cannot give back, and its wish stands.
TEST(RealtimeStage, AImageThatFindsNoRoomIsNotLent) {
  constexpr int kRoom = 256;
  const Scene scene;
  const auto stage = std::make_unique<RealtimeStage>(options_with_images(), true, true);
  const auto process = [&](int frame, ImageSlot slot) {
    stage->push(image_message(scene, frame, slot));
    EXPECT_TRUE(stage->process());
  };
  for (int frame = 0; frame < kRoom; ++frame) {  // without images, which would be searched
    stage->push(frame_message(frame));
    EXPECT_TRUE(stage->process());
  }
  stage->want_image();
  process(kRoom, 7);
  ImageSlot slot = kNoImageSlot;
  ASSERT_TRUE(stage->pop_returned(slot)) << "nobody else would give it back";
  EXPECT_EQ(slot, 7);
  FeedFrame fed;
  int heard = 0;
  while (stage->pop(fed)) {
    ++heard;
    EXPECT_EQ(fed.slot, kNoImageSlot);
  }
  EXPECT_EQ(heard, kRoom) << "the queue was just full";
  // With room again, the next image is lent without another wish.
  process(kRoom + 1, 8);
  ASSERT_TRUE(stage->pop(fed));
  EXPECT_EQ(fed.slot, 8);
  EXPECT_TRUE(fed.image.valid());
  EXPECT_FALSE(stage->pop_returned(slot));
}

TEST(RealtimeStage, TellsTheCalibrationThreadOfTracksSamplesAndLosses) {
  const Scene scene;
  const auto stage = std::make_unique<RealtimeStage>(options_with_images(), true, true);
  stage->push(sample_message(0.25));
  stage->push(image_message(scene, 0, kNoImageSlot));
  stage->push(image_message(scene, 1, kNoImageSlot));
  EXPECT_TRUE(stage->process());
  PanTiltSample sample;
  ASSERT_TRUE(stage->pop(sample));
  EXPECT_EQ(sample.pan_rad, 0.25);
  FeedFrame fed;
  ASSERT_TRUE(stage->pop(fed));
  ASSERT_TRUE(stage->pop(fed));
  EXPECT_EQ(fed.tracks.tracker, FrameTracks::Tracker::kStartUp);
  EXPECT_GT(fed.tracks.count, 20);
  EXPECT_FALSE(stage->video_is_lost());
  VideoMessage lost;
  lost.kind = VideoMessage::Kind::kLost;
  stage->push(lost);
  TelemetryMessage silent;
  silent.kind = TelemetryMessage::Kind::kLost;
  stage->push(silent);
  EXPECT_TRUE(stage->process());
  EXPECT_TRUE(stage->video_is_lost());
  EXPECT_TRUE(stage->telemetry_is_lost());
}

// The telemetry queue holds 1024, that of the calibration thread, which does not listen, 4096.
TEST(RealtimeStage, CountsTheSamplesThatTheCalibrationThreadDoesNotHear) {
  const auto stage = std::make_unique<RealtimeStage>(options_with_images(), true, true);
  for (int filling = 0; filling < 5; ++filling) {
    for (int i = 0; i < 1024; ++i) stage->push(sample_message(0.001 * i));
    EXPECT_TRUE(stage->process());
  }
  EXPECT_EQ(stage->drops().telemetry, 0);
  EXPECT_EQ(stage->drops().unheard, 5 * 1024 - 4096);
}

// The frames' queue to it holds 256. What no longer fits may have begun another clock.
TEST(RealtimeStage, TellsTheCalibrationThreadOfRestartsThatItDidNotHearOf) {
  const auto stage = std::make_unique<RealtimeStage>(options_with_images(), true, true);
  const auto frame = [&](int i, bool restarted) {
    VideoMessage message = frame_message(i);
    message.stamp.sequence = i;
    message.stamp.restarted = restarted;
    stage->push(message);
    EXPECT_TRUE(stage->process());
    while (count_records(stage.get()) > 0) {
    }
  };
  const auto sample = [&](int i, bool restarted) {
    TelemetryMessage message = sample_message(0.001 * i);
    message.sample.restarted = restarted;
    stage->push(message);
    EXPECT_TRUE(stage->process());
  };
  for (int i = 0; i < 256; ++i) frame(i, false);
  for (int i = 0; i < 4096; ++i) sample(i, false);
  EXPECT_EQ(stage->drops().unheard, 0);
  for (int i = 0; i < 3; ++i) {
    frame(256 + i, i == 1);
    sample(4096 + i, i == 1);
  }
  EXPECT_EQ(stage->drops().unheard, 6);
  FeedFrame fed;
  PanTiltSample heard;
  while (stage->pop(fed)) EXPECT_FALSE(fed.tracks.clock_restarted);
  while (stage->pop(heard)) EXPECT_FALSE(heard.restarted);
  for (int i = 0; i < 2; ++i) {
    frame(300 + i, false);
    sample(5000 + i, false);
    ASSERT_TRUE(stage->pop(fed));
    ASSERT_TRUE(stage->pop(heard));
    EXPECT_EQ(fed.tracks.clock_restarted, i == 0);
    EXPECT_EQ(heard.restarted, i == 0);
  }
}

TEST(RealtimeStage, TakesOverWhatIsPublishedBeforeTheNextFrame) {
  const Scene scene;
  const auto stage = std::make_unique<RealtimeStage>(options_with_images(), true, true);
  PublishedCalibration published;
  published.calibration = options_with_images().calibration;
  published.calibration.camera.focal_length = 2100;
  published.calibrated = true;
  stage->report({CalibrationActivity::kWatching, CalibrationNeed::kNothing});
  ASSERT_TRUE(stage->publish(&published));
  stage->push(image_message(scene, 0, kNoImageSlot));
  EXPECT_TRUE(stage->process());
  OutputMessage out;
  ASSERT_TRUE(stage->pop(out));
  EXPECT_TRUE(out.record.calibrated);
  EXPECT_EQ(out.record.camera.focal_length, 2100);
  EXPECT_EQ(out.record.calibration.activity, CalibrationActivity::kWatching);
  const PublishedCalibration* adopted = nullptr;
  ASSERT_TRUE(stage->pop_adopted(adopted));
  EXPECT_EQ(adopted, &published) << "and is given back to whom it belongs";
  EXPECT_FALSE(stage->pop_adopted(adopted));
}

TEST(RealtimeStage, LendsTheTapWhatItAskedForUnlessTheCalibrationThreadHasIt) {
  const Scene scene;
  ImageTap tap;
  const auto stage = std::make_unique<RealtimeStage>(options_with_images(), true, true, &tap);
  const auto process = [&](int frame) {
    stage->push(image_message(scene, frame, frame));
    EXPECT_TRUE(stage->process());
  };
  const auto returned = [&] {
    ImageSlot slot = kNoImageSlot;
    return stage->pop_returned(slot) ? slot : kNoImageSlot;
  };
  process(0);
  EXPECT_EQ(returned(), 0) << "nobody asked";
  EXPECT_EQ(tap.ask(std::chrono::milliseconds(0)), nullptr);
  stage->want_image();
  process(1);
  EXPECT_EQ(returned(), kNoImageSlot) << "with the calibration thread";
  process(2);
  EXPECT_EQ(returned(), kNoImageSlot) << "with the tap";
  process(3);
  EXPECT_EQ(returned(), 3) << "one wish, one picture";
  stage->end_input();
  EXPECT_FALSE(stage->process());
  tap.run();
  EXPECT_EQ(returned(), 2);
  const auto image = tap.of_frame(2);
  ASSERT_NE(image, nullptr);
  EXPECT_EQ(image->landmarks.kind, FrameLandmarks::Kind::kPoints);
  EXPECT_GT(image->landmarks.count, 20);
}

// Frames that come faster than they can be looked at, in OE mode or while points are followed: the last one is looked
// at, and those that it waited for are not.
TEST(RealtimeStage, LooksAtNoLateImageThatOthersWaitBehind) {
  const Scene scene;
  for (const bool live : {true, false}) {
    for (const bool calibrated : {true, false}) {
      SCOPED_TRACE(testing::Message() << "live " << live << ", calibrated " << calibrated);
      OrientationStepOptions options = options_with_images();
      options.calibrated = calibrated;
      const auto stage = std::make_unique<RealtimeStage>(options, live, true);
      for (int i = -4; i <= 0; ++i) {
        TelemetryMessage sample = sample_message(1e-4 * i);
        sample.sample.earliest_time_s += 0.02 * i;
        sample.sample.latest_time_s += 0.02 * i;
        stage->push(sample);
      }
      for (int frame = 0; frame < 4; ++frame) {
        VideoMessage message = image_message(scene, frame, frame);
        if (frame != 1) message.decoded_s = monotonic_now_s() - 1e3;
        stage->push(message);
      }
      EXPECT_TRUE(stage->process());
      EXPECT_EQ(stage->drops().late_images, live ? 2 : 0);
      EXPECT_EQ(stage->drops().total(), 0) << "no frame is lost by it";
      OutputMessage out;
      for (int frame = 0; frame < 4; ++frame) {
        const bool late = live && (frame == 0 || frame == 2);
        ASSERT_TRUE(stage->pop(out));
        EXPECT_EQ(out.record.status == RecordStatus::kImageTooLate, late && calibrated) << frame;
        EXPECT_NE(out.record.mode, RecordMode::kNone) << frame;
        FeedFrame fed;
        ASSERT_TRUE(stage->pop(fed));
        EXPECT_EQ(fed.tracks.tracker == FrameTracks::Tracker::kNone, late) << frame;
        ImageSlot slot = kNoImageSlot;
        ASSERT_TRUE(stage->pop_returned(slot));
        EXPECT_EQ(slot, frame);
      }
    }
  }
}

// Following points, taking over a calibration with a map, OE mode, another zoom and back, somebody who looks at it: all
// without allocating.
TEST(RealtimeStage, AllocatesNothingWhileCalibrationsComeAndGo) {
  const Scene scene;
  ImageTap tap(std::chrono::milliseconds(0));
  std::thread tap_thread(&ImageTap::run, &tap);
  const auto stage = std::make_unique<RealtimeStage>(options_with_images(), true, true, &tap);
  PublishedCalibration calibrated;
  calibrated.calibration = options_with_images().calibration;
  calibrated.calibrated = true;
  calibrated.map.landmarks.resize(500);
  PublishedCalibration withdrawn;
  withdrawn.calibration = calibrated.calibration;
  const double begin_s = monotonic_now_s();
  int oe = 0;
  int followed = 0;
  {
    const test::AllocationGuard guard;
    FeedFrame fed;
    PanTiltSample sample;
    OutputMessage out;
    for (int i = 0; i < 200; ++i) {
      const double time_s = begin_s + 0.02 * i;  // however busy the machine is
      TelemetryMessage message = sample_message(0);
      message.sample.earliest_time_s = time_s - 1e-3;
      message.sample.latest_time_s = time_s;
      message.sample.zoom = i > 150 && i < 170 ? 2 : 1;
      stage->push(message);
      bool published = true;
      if (i == 50 || i == 130) published = stage->publish(&calibrated);
      if (i == 110) published = stage->publish(&withdrawn);
      EXPECT_TRUE(published);
      if (i % 7 == 0) stage->want_image();
      const bool looked_at = i == 20 || i == 101;
      if (looked_at) {
        EXPECT_EQ(tap.ask(std::chrono::milliseconds(0)), nullptr);
      }
      VideoMessage image = image_message(scene, i % 2, 0);
      image.stamp.receive_time_s = time_s;
      stage->push(image);
      EXPECT_TRUE(stage->process());
      while (looked_at && tap.of_frame(i % 2) == nullptr) std::this_thread::yield();
      while (stage->pop(out)) oe += out.record.mode == RecordMode::kOe ? 1 : 0;
      while (stage->pop(fed)) {
        followed += fed.tracks.tracker == FrameTracks::Tracker::kStartUp ? 1 : 0;
        if (fed.slot != kNoImageSlot) stage->give_back(fed.slot);
      }
      while (stage->pop(sample)) {
      }
      for (ImageSlot slot = kNoImageSlot; stage->pop_returned(slot);) {
      }
      for (const PublishedCalibration* adopted = nullptr; stage->pop_adopted(adopted);) {
      }
    }
    EXPECT_EQ(guard.count(), 0);
  }
  EXPECT_GT(oe, 50);
  EXPECT_GE(followed, 50 + 20 + 19);
  tap.end();
  tap_thread.join();
  EXPECT_EQ(tap.of_frame(0)->landmarks.kind, FrameLandmarks::Kind::kPoints);
  EXPECT_EQ(tap.of_frame(1)->landmarks.kind, FrameLandmarks::Kind::kLandmarks);
}

}  // namespace
}  // namespace alidade
