#include "edge_app/tracking/target_feed.h"

#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>

#include "test/edge_app/tracking/detected_scene.h"

namespace alidade {
namespace {

DetectedFrame ground_seen(std::int64_t number) {
  const FrameOrientation frame = test::swinging_frame(test::watching_calibration(), number);
  const Vector2<double> X =
      test::place_in_view(test::mast(), test::swinging_frame(test::watching_calibration(), 0));
  return test::detected(number, frame,
                        {test::box_with_foot(test::foot_of(test::mast(), frame, X))});
}

// Waits for news.
class News {
 public:
  void take(const std::shared_ptr<const TargetsState>& state) {
    const std::lock_guard<std::mutex> lock(mutex_);
    newest_ = state;
    came_.notify_all();
  }
  std::shared_ptr<const TargetsState> wait_for(std::int64_t updates) {
    std::unique_lock<std::mutex> lock(mutex_);
    came_.wait(lock, [&] { return newest_ && newest_->updates >= updates; });
    return newest_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable came_;
  std::shared_ptr<const TargetsState> newest_;
};

TEST(TargetFeed, TakesWhatItsQueueHoldsAndRefusesTheRest) {
  TargetFeed feed(default_target_options(TargetSpace::kPlane), test::mast_plane());
  News news;
  feed.add_on_news([&news](const auto& state) { news.take(state); });
  const auto most = static_cast<std::int64_t>(TargetFeed::kMostWaiting);
  // Nobody takes them out yet.
  for (std::int64_t i = 0; i < most; ++i)
    ASSERT_EQ(feed.offer(ground_seen(i)).status, DetectionStatus::kTaken);
  for (int i = 0; i < 3; ++i)
    EXPECT_EQ(feed.offer(ground_seen(most + i)).status, DetectionStatus::kQueueFull);
  EXPECT_EQ(feed.snapshot().waiting, TargetFeed::kMostWaiting);
  EXPECT_EQ(feed.snapshot().newest, nullptr);
  EXPECT_EQ(feed.snapshot().counters.of(DetectionStatus::kQueueFull), 3);
  ASSERT_TRUE(feed.start());
  const auto state = news.wait_for(most);
  EXPECT_EQ(state->targets.size(), 1U);
  EXPECT_EQ(feed.snapshot().newest->updates, most);
  EXPECT_EQ(feed.snapshot().counters.of(DetectionStatus::kTaken), most);
  // There is room again.
  ASSERT_EQ(feed.offer(ground_seen(most + 3)).status, DetectionStatus::kTaken);
  EXPECT_EQ(*news.wait_for(most + 1)->record.frame, most + 3);
  feed.stop();
}

TEST(TargetFeed, RefusesAtOnceWhatCanBeSeenAtOnce) {
  TargetFeed feed(default_target_options(TargetSpace::kPlane), test::mast_plane());
  News news;
  feed.add_on_news([&news](const auto& state) { news.take(state); });
  ASSERT_TRUE(feed.start());
  ASSERT_EQ(feed.offer(ground_seen(1000)).status, DetectionStatus::kTaken);
  static_cast<void>(news.wait_for(1));
  EXPECT_EQ(feed.offer(ground_seen(949)).status, DetectionStatus::kTooLate);
  DetectedFrame outside = ground_seen(1001);
  outside.boxes[0].u = -4000;
  const DetectionAnswer answer = feed.offer(outside);
  EXPECT_EQ(answer.status, DetectionStatus::kTaken);
  ASSERT_EQ(answer.left_out.size(), 1U);
  EXPECT_EQ(answer.left_out[0].fault, BoxFault::kOutside);
  feed.count_refused(DetectionStatus::kMalformed);
  static_cast<void>(news.wait_for(2));
  EXPECT_EQ(feed.offer(ground_seen(1001)).status, DetectionStatus::kRepeated);
  ASSERT_EQ(feed.offer(ground_seen(1002)).status, DetectionStatus::kTaken);
  static_cast<void>(news.wait_for(3));
  const TargetCounters counters = feed.snapshot().counters;
  EXPECT_EQ(counters.of(DetectionStatus::kTooLate), 1);
  EXPECT_EQ(counters.of(BoxFault::kOutside), 1);
  EXPECT_EQ(counters.of(DetectionStatus::kMalformed), 1);
  EXPECT_EQ(counters.of(DetectionStatus::kRepeated), 1);
  EXPECT_EQ(counters.of(DetectionStatus::kTaken), 3);
}

TEST(TargetFeed, EndsWithoutTakingWhatWaits) {
  TargetFeed feed(default_target_options(TargetSpace::kSphere), nullptr);
  EXPECT_EQ(feed.offer(ground_seen(1)).status, DetectionStatus::kTaken);
  feed.stop();
  EXPECT_EQ(feed.snapshot().waiting, 1U);
}

}  // namespace
}  // namespace alidade
