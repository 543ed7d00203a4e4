// The newest picture for detectors: what is replaced is counted and given back, every slot comes back once, the real-time thread allocates nothing.

#include "edge_app/taps/detector_tap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <set>
#include <thread>
#include <vector>

#include "test/support/allocation_guard.h"

namespace alidade {
namespace {

class NotingDetector : public FrameDetector {
 public:
  void look(const DetectableFrame& frame) override {
    seen.push_back(*frame.record.frame);
    // The picture and its record are of one frame.
    whole = whole && frame.slot == *frame.record.frame % kImageSlots;
    looked.store(static_cast<int>(seen.size()), std::memory_order_release);
  }
  std::vector<std::int64_t> seen;
  bool whole = true;
  std::atomic<int> looked{0};
};

OrientationRecord detectable_record(std::int64_t frame) {
  OrientationRecord record;
  record.frame = frame;
  record.time_s = 0.04 * static_cast<double>(frame);
  record.mode = RecordMode::kOe;
  record.orientation = OrientationRecord::Orientation{};
  return record;
}

TEST(DetectorTap, TakesFramesInOeModeOnly) {
  OrientationRecord record = detectable_record(1);
  EXPECT_TRUE(DetectorTap::takes(record));
  record.mode = RecordMode::kPt;
  EXPECT_FALSE(DetectorTap::takes(record));
  record = detectable_record(1);
  record.time_s.reset();
  EXPECT_FALSE(DetectorTap::takes(record));
  record = detectable_record(1);
  record.orientation.reset();
  EXPECT_FALSE(DetectorTap::takes(record));
}

TEST(DetectorTap, TheNewestTakesThePlaceOfWhatWaits) {
  NotingDetector detector;
  DetectorTap tap(detector);
  EXPECT_EQ(tap.put(detectable_record(0), {}, 0), kNoImageSlot);
  EXPECT_EQ(tap.put(detectable_record(1), {}, 1), 0);
  EXPECT_EQ(tap.put(detectable_record(2), {}, 2), 1);
  EXPECT_EQ(tap.replaced(), 2);
  std::thread thread(&DetectorTap::run, &tap);
  while (detector.looked.load(std::memory_order_acquire) < 1) std::this_thread::yield();
  tap.end();
  thread.join();
  EXPECT_EQ(detector.seen, std::vector<std::int64_t>{2});
  ImageSlot slot = kNoImageSlot;
  ASSERT_TRUE(tap.pop_returned(slot));
  EXPECT_EQ(slot, 2);
  EXPECT_FALSE(tap.pop_returned(slot));
}

TEST(DetectorTap, GivesBackWhatWaitsAtTheEndAndDoesNotLook) {
  NotingDetector detector;
  DetectorTap tap(detector);
  EXPECT_EQ(tap.put(detectable_record(7), {}, 7), kNoImageSlot);
  tap.end();
  tap.run();
  EXPECT_TRUE(detector.seen.empty());
  ImageSlot slot = kNoImageSlot;
  ASSERT_TRUE(tap.pop_returned(slot));
  EXPECT_EQ(slot, 7);
}

TEST(DetectorTap, EverySlotComesBackOnceWhileBothThreadsRun) {
  constexpr std::int64_t kFrames = 20000;
  NotingDetector detector;
  detector.seen.reserve(kFrames);
  DetectorTap tap(detector);
  std::thread thread(&DetectorTap::run, &tap);
  std::set<ImageSlot> free;
  for (ImageSlot slot = 0; slot < kImageSlots; ++slot) free.insert(slot);
  std::int64_t allocations = 0;
  for (std::int64_t i = 0; i < kFrames; ++i) {
    const auto wanted = static_cast<ImageSlot>(i % kImageSlots);
    for (ImageSlot slot = kNoImageSlot; tap.pop_returned(slot);)
      ASSERT_TRUE(free.insert(slot).second) << "came back twice";
    // Whoever still looks at a picture of a round before.
    while (free.erase(wanted) == 0) {
      for (ImageSlot slot = kNoImageSlot; tap.pop_returned(slot);)
        ASSERT_TRUE(free.insert(slot).second) << "came back twice";
      std::this_thread::yield();
    }
    const OrientationRecord record = detectable_record(i);
    ImageSlot replaced = kNoImageSlot;
    {
      const test::AllocationGuard guard;
      replaced = tap.put(record, {}, wanted);
      allocations += guard.count();
    }
    if (replaced != kNoImageSlot) {
      ASSERT_TRUE(free.insert(replaced).second) << "came back twice";
    }
  }
  tap.end();
  thread.join();
  for (ImageSlot slot = kNoImageSlot; tap.pop_returned(slot);)
    ASSERT_TRUE(free.insert(slot).second);
  EXPECT_EQ(free.size(), static_cast<std::size_t>(kImageSlots));
  EXPECT_EQ(allocations, 0);
  EXPECT_TRUE(detector.whole);
  EXPECT_TRUE(std::is_sorted(detector.seen.begin(), detector.seen.end()));
}

}  // namespace
}  // namespace alidade
