#include "edge_app/pipeline/pending_frames.h"

#include <gtest/gtest.h>

namespace alidade::test {
namespace {

TEST(PendingFrames, AreGivenOnceAndOldestFirstWhenASampleHasPassedThem) {
  PendingFrames pending;
  EXPECT_FALSE(pending.take(1e9).has_value());
  for (int i = 0; i < 3; ++i) pending.add({1.0 + i, 1.1 + i, 1e-3 * i});
  EXPECT_FALSE(pending.take(1.09).has_value());
  const auto first = pending.take(2.2);
  ASSERT_TRUE(first.has_value());
  EXPECT_EQ(first->frame_time_s, 1.0);
  EXPECT_EQ(first->telemetry_time_s, 1.1);
  const auto second = pending.take(2.2);
  ASSERT_TRUE(second.has_value());
  EXPECT_EQ(second->frame_time_s, 2.0);
  EXPECT_EQ(second->time_sigma_s, 1e-3);
  EXPECT_FALSE(pending.take(2.2).has_value());
  EXPECT_EQ(pending.size(), 1U);
}

TEST(PendingFrames, ForgetTheOldestWhereThereIsNoRoom) {
  PendingFrames pending;
  constexpr int kMore = 5;
  constexpr int kAll = static_cast<int>(PendingFrames::kCapacity) + kMore;
  for (int i = 0; i < kAll; ++i) pending.add({1.0 * i, 1.0 * i, 0});
  EXPECT_EQ(pending.size(), PendingFrames::kCapacity);
  for (int i = kMore; i < kAll; ++i) {
    const auto frame = pending.take(1e9);
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(frame->frame_time_s, i);
  }
  EXPECT_FALSE(pending.take(1e9).has_value());
  pending.add({1, 1, 0});
  pending.clear();
  EXPECT_FALSE(pending.take(1e9).has_value());
}

}  // namespace
}  // namespace alidade::test
