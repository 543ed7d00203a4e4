// How a link does, as those who ask hear it: before it stands, while it does, lost and back again.

#include "edge_app/pipeline/link_watch.h"

#include <gtest/gtest.h>

namespace alidade {
namespace {

TEST(LinkWatch, KnowsNothingBeforeTheFirstAttempt) {
  const LinkHealth status = LinkWatch().now(5);
  EXPECT_FALSE(status.connected);
  EXPECT_EQ(status.reason, "");
  EXPECT_EQ(status.reconnections, 0);
  EXPECT_FALSE(status.age_s);
  EXPECT_FALSE(status.rate_hz);
}

TEST(LinkWatch, TellsAgeAndRateOfWhatComes) {
  LinkWatch watch;
  watch.item(10);
  EXPECT_TRUE(watch.now(10.5).connected);
  EXPECT_FALSE(watch.now(10.5).rate_hz) << "one item has no rate";
  for (int i = 1; i <= 200; ++i) watch.item(10 + 0.04 * i);
  const LinkHealth status = watch.now(18.01);
  EXPECT_NEAR(*status.age_s, 0.01, 1e-9);
  EXPECT_NEAR(*status.rate_hz, 25, 1e-6);
}

TEST(LinkWatch, TheRateDoesNotMindBunchesAndFollowsWithinItsMemory) {
  LinkWatch watch;
  // Four at a time, ten times a second.
  for (int i = 0; i < 400; ++i) watch.item(0.1 * (i / 4));
  EXPECT_NEAR(*watch.now(9.9).rate_hz, 40, 0.1 * 40);
  for (int i = 1; i <= 5 * LinkWatch::kMemory; ++i) watch.item(9.9 + 0.2 * i);
  EXPECT_NEAR(*watch.now(9.9 + LinkWatch::kMemory).rate_hz, 5, 0.01 * 5);
}

TEST(LinkWatch, TheRateFallsWhileNothingComes) {
  LinkWatch watch;
  for (int i = 0; i < 10; ++i) watch.item(0.1 * i);
  EXPECT_NEAR(*watch.now(0.9).rate_hz, 10, 1e-6);
  EXPECT_NEAR(*watch.now(4.9).rate_hz, 0.25, 1e-6);
}

TEST(LinkWatch, SaysWhatIsWaitedForWhetherItStandsOrNot) {
  LinkWatch watch;
  watch.lost("refused");
  watch.waiting("waiting for a key frame since 3 s");
  EXPECT_EQ(watch.now(1).reason, "waiting for a key frame since 3 s");
  EXPECT_FALSE(watch.now(1).connected);
  watch.waiting("");
  EXPECT_EQ(watch.now(1).reason, "refused");
  watch.item(2);
  watch.waiting("waiting for a key frame since 4 s");
  EXPECT_EQ(watch.now(2).reason, "waiting for a key frame since 4 s");
  EXPECT_TRUE(watch.now(2).connected);
  watch.waiting("");
  EXPECT_EQ(watch.now(2).reason, "");
}

TEST(LinkWatch, SaysWhyThereIsNoConnectionUntilThereIs) {
  LinkWatch watch;
  watch.lost("refused");
  EXPECT_EQ(watch.now(1).reason, "refused");
  watch.item(2);
  watch.item(2.1);
  EXPECT_EQ(watch.now(2.1).reason, "");
  EXPECT_EQ(watch.now(2.1).reconnections, 0) << "the first connection is none";
  watch.lost("nothing comes");
  watch.lost("401");
  const LinkHealth lost = watch.now(4.1);
  EXPECT_FALSE(lost.connected);
  EXPECT_EQ(lost.reason, "401") << "the newest reason";
  EXPECT_NEAR(*lost.age_s, 2, 1e-9);
  watch.item(60);
  const LinkHealth back = watch.now(60);
  EXPECT_TRUE(back.connected);
  EXPECT_EQ(back.reconnections, 1);
  EXPECT_FALSE(back.rate_hz) << "the pause is no interval";
}

}  // namespace
}  // namespace alidade
