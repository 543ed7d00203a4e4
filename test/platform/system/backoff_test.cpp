#include "platform/system/backoff.h"

#include <gtest/gtest.h>

namespace alidade {
namespace {

TEST(Backoff, DoublesUpToItsLimitAndBeginsAnewAfterASuccess) {
  Backoff backoff(0.9);
  EXPECT_EQ(backoff.next_s(), 0.25);
  EXPECT_EQ(backoff.next_s(), 0.5);
  EXPECT_EQ(backoff.next_s(), 0.9);
  EXPECT_EQ(backoff.next_s(), 0.9);
  backoff.reset();
  EXPECT_EQ(backoff.next_s(), 0.25);
}

TEST(Backoff, NeverExceedsALimitBelowItsFirstPause) {
  Backoff backoff(0.01);
  EXPECT_EQ(backoff.next_s(), 0.01);
  EXPECT_EQ(backoff.next_s(), 0.01);
}

}  // namespace
}  // namespace alidade
