// Pictures for localization: when one is wanted, that the real-time thread neither waits nor allocates for it, and that every slot comes
// back.

#include "edge_app/taps/scene_tap.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

#include "edge_app/pipeline/realtime_stage.h"
#include "platform/system/clock.h"
#include "test/support/allocation_guard.h"

namespace alidade {
namespace {

using Outcome = SceneLocator::Outcome;

// Says what it is told to say, of a base that is 5 mrad off.
class ScriptedLocator : public SceneLocator {
 public:
  explicit ScriptedLocator(std::vector<Outcome> outcomes) : outcomes_(std::move(outcomes)) {}

  void prepare() override {}
  Outcome look(const LocalizableFrame& frame, ToldBase* told) override {
    told->change_rad = {frame.record.localized ? 0 : 5e-3, 0};
    told->covariance = {1e-10, 0, 1e-10};
    const int i = looked_++;
    return i < static_cast<int>(outcomes_.size()) ? outcomes_[static_cast<std::size_t>(i)]
                                                  : Outcome::kTold;
  }
  [[nodiscard]] int looked() const { return looked_; }

 private:
  std::vector<Outcome> outcomes_;
  std::atomic<int> looked_{0};
};

LocalizableFrame frame_of(ImageSlot slot, RecordMode mode) {
  LocalizableFrame frame;
  frame.record.frame = slot;
  frame.record.time_s = slot;
  frame.record.mode = mode;
  frame.record.orientation = OrientationRecord::Orientation();
  frame.slot = slot;
  return frame;
}

// The localization thread, which wakes nobody.
class Looking {
 public:
  explicit Looking(SceneTap* tap) : tap_(tap), thread_([tap] { tap->run([] {}); }) {}
  ~Looking() {
    tap_->end();
    thread_.join();
  }
  // Waits until another picture is wanted at this time.
  void wait_until_wanted(double now_s, RecordMode mode) {
    while (!tap_->wants(now_s, mode, false)) std::this_thread::yield();
  }
  void wait_for_slot(ImageSlot expected) {
    ImageSlot slot = kNoImageSlot;
    while (!tap_->pop_returned(slot)) std::this_thread::yield();
    EXPECT_EQ(slot, expected);
  }

 private:
  SceneTap* tap_;
  std::thread thread_;
};

TEST(SceneTap, WantsOnePictureAtATimeAndTheNextWhenThereIsReason) {
  ScriptedLocator locator({});
  SceneTap tap(locator, {1000, 1});
  EXPECT_FALSE(tap.wants(0, RecordMode::kOe, false)) << "nobody looks yet";
  Looking looking(&tap);
  const double begin_s = monotonic_now_s();
  looking.wait_until_wanted(begin_s, RecordMode::kPt);
  ASSERT_TRUE(tap.push(frame_of(1, RecordMode::kPt)));
  looking.wait_for_slot(1);
  const double soon_s = begin_s + 100;
  // Landmarks that hold are a reason.
  looking.wait_until_wanted(soon_s, RecordMode::kOe);
  EXPECT_FALSE(tap.wants(soon_s, RecordMode::kPt, false)) << "as before";
  ASSERT_TRUE(tap.push(frame_of(2, RecordMode::kOe)));
  looking.wait_for_slot(2);
  // Once landmarks are lost, again; at once it never is.
  looking.wait_until_wanted(soon_s, RecordMode::kPt);
  EXPECT_FALSE(tap.wants(begin_s, RecordMode::kPt, false));
  EXPECT_FALSE(tap.wants(soon_s, RecordMode::kOe, false));
  // A new connection is a reason until somebody has looked.
  EXPECT_TRUE(tap.wants(soon_s, RecordMode::kOe, true));
  EXPECT_TRUE(tap.wants(soon_s, RecordMode::kOe, false));
  EXPECT_TRUE(tap.wants(begin_s + 2000, RecordMode::kOe, false)) << "in any case";
  EXPECT_EQ(locator.looked(), 2);
}

TEST(SceneTap, WaitsLongerTheLongerItIsInVain) {
  ScriptedLocator locator(std::vector<Outcome>(4, Outcome::kNotFound));
  SceneTap tap(locator, {1000, 1});
  Looking looking(&tap);
  double longest_s = 0;
  for (ImageSlot i = 0; i < 4; ++i) {
    looking.wait_until_wanted(monotonic_now_s() + 1e6, RecordMode::kOe);
    ASSERT_TRUE(tap.push(frame_of(i, RecordMode::kOe)));
    looking.wait_for_slot(i);
    looking.wait_until_wanted(monotonic_now_s() + 1e6, RecordMode::kOe);
    const double now_s = monotonic_now_s();
    double wait_s = 0;
    while (!tap.wants(now_s + wait_s, RecordMode::kOe, false)) wait_s += 0.25;
    EXPECT_GT(wait_s, 1.5 * longest_s);
    longest_s = wait_s;
  }
  EXPECT_GT(longest_s, 8);
}

// Without telemetry nothing is known until a picture is found.
TEST(SceneTap, DoesNotWaitLongerWhereThereIsNoOrientation) {
  ScriptedLocator locator(std::vector<Outcome>(4, Outcome::kNotFound));
  SceneTap tap(locator, {1000, 1});
  Looking looking(&tap);
  for (ImageSlot i = 0; i < 4; ++i) {
    LocalizableFrame frame = frame_of(i, RecordMode::kNone);
    frame.record.orientation.reset();
    looking.wait_until_wanted(monotonic_now_s() + 1.1, RecordMode::kNone);
    ASSERT_TRUE(tap.push(frame));
    looking.wait_for_slot(i);
  }
  EXPECT_EQ(locator.looked(), 4);
}

TEST(SceneTap, GivesBackWhatWaitsAtTheEnd) {
  ScriptedLocator locator({});
  SceneTap tap(locator, {1000, 1});
  {
    Looking looking(&tap);
    looking.wait_until_wanted(monotonic_now_s(), RecordMode::kOe);
    ASSERT_TRUE(tap.push(frame_of(7, RecordMode::kOe)));
  }
  ImageSlot slot = kNoImageSlot;
  ASSERT_TRUE(tap.pop_returned(slot));
  EXPECT_EQ(slot, 7);
}

// Through the real-time thread: a picture is lent, its answer ties the records, and nothing is allocated there.
TEST(SceneTap, TiesTheRecordsOfTheRealTimeThread) {
  constexpr int kWidth = 64;
  constexpr int kHeight = 48;
  const std::vector<std::uint8_t> grey(kWidth * kHeight, 128);
  ScriptedLocator locator({});
  SceneTap tap(locator, {1000, 1});
  OrientationStepOptions options;
  options.calibration.camera = {100, 1, {0}, kWidth, kHeight};
  options.calibrated = true;
  options.oe = oe_options(options.calibration.camera);
  RealtimeStage stage(options, false, false, nullptr, &tap);
  std::thread looking([&] { tap.run([&] { stage.wake(); }); });
  std::optional<OrientationRecord> tied;
  bool was_untied = false;
  std::int64_t allocations = 0;
  int frame = 0;
  for (; frame < 100'000 && !tied; ++frame) {
    TelemetryMessage sample;
    sample.sample.latest_time_s = 0.04 * frame;
    sample.sample.earliest_time_s = sample.sample.latest_time_s - 1e-3;
    stage.push(sample);
    VideoMessage message;
    message.stamp.frame = frame;
    message.stamp.receive_time_s = 0.04 * frame;
    message.image = {grey.data(), kWidth, kHeight, kWidth};
    message.slot = 3;
    stage.push(message);
    {
      const test::AllocationGuard guard;
      stage.process();
      allocations += guard.count();
    }
    OutputMessage out;
    while (stage.pop(out)) {
      if (out.record.localized) {
        tied = out.record;
      } else if (out.record.orientation) {
        was_untied = true;
        EXPECT_NEAR(out.record.orientation->pan_rad, 0, 1e-9);
      }
    }
    // A slot comes back from each of its ways.
    for (ImageSlot slot = kNoImageSlot; !stage.pop_returned(slot);) std::this_thread::yield();
  }
  stage.end_input();
  EXPECT_FALSE(stage.process());
  looking.join();
  ASSERT_TRUE(tied);
  EXPECT_TRUE(was_untied);
  EXPECT_EQ(allocations, 0);
  EXPECT_NEAR(tied->orientation->pan_rad, 5e-3, 1e-9);
  EXPECT_NEAR(tied->localized->telemetry_zero.pan, 5e-3, 1e-9);
  EXPECT_GT(tied->localized->sigma_rad, 1e-5);
  EXPECT_GE(tied->localized->age_s, 0.04 - 1e-9);
}

}  // namespace
}  // namespace alidade
