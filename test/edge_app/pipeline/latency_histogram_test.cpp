#include "edge_app/pipeline/latency_histogram.h"

#include <gtest/gtest.h>

namespace alidade {
namespace {

TEST(LatencyHistogram, IsZeroWhenEmpty) { EXPECT_EQ(LatencyHistogram().quantile(0.5), 0); }

TEST(LatencyHistogram, GivesQuantilesToFivePercent) {
  LatencyHistogram histogram;
  for (int i = 1; i <= 1000; ++i) histogram.add(1e-5 * i);
  EXPECT_GE(histogram.quantile(0.5), 5e-3);
  EXPECT_LE(histogram.quantile(0.5), 5e-3 * 1.05);
  EXPECT_GE(histogram.quantile(0.99), 9.9e-3);
  EXPECT_LE(histogram.quantile(0.99), 9.9e-3 * 1.05);
}

TEST(LatencyHistogram, AQuantileThatABucketJustReachesLiesInIt) {
  LatencyHistogram histogram;
  for (const double seconds : {1e-3, 0.1}) histogram.add(seconds);
  EXPECT_LE(histogram.quantile(0.5), 1.05e-3);
  EXPECT_GE(histogram.quantile(0.51), 0.1);
}

TEST(LatencyHistogram, NoQuantileIsLongerThanTheLongest) {
  LatencyHistogram histogram;
  for (int i = 1; i <= 100; ++i) {
    histogram.add(1.7e-4 * i);
    EXPECT_LE(histogram.quantile(0.99), histogram.longest_s());
    EXPECT_GE(histogram.quantile(1), histogram.longest_s());
  }
}

TEST(LatencyHistogram, CountsWhatIsNoLongerThanABucketsEdge) {
  LatencyHistogram histogram;
  for (const double seconds : {0.0, 1e-6, 1.04e-6, 1.06e-6, 0.02}) histogram.add(seconds);
  EXPECT_EQ(histogram.count(0), 2);
  EXPECT_EQ(histogram.count(1), 1);
  EXPECT_EQ(histogram.count(2), 1);
  EXPECT_EQ(LatencyHistogram::upper_edge_s(0), 1e-6);
  EXPECT_NEAR(LatencyHistogram::upper_edge_s(2), 1.05 * 1.05e-6, 1e-15);
  EXPECT_EQ(histogram.total(), 5);
  EXPECT_NEAR(histogram.sum_s(), 0.0200031, 1e-12);
  EXPECT_EQ(histogram.longest_s(), 0.02);
}

TEST(LatencyHistogram, KeepsValuesBeyondItsRangeInTheEndBuckets) {
  LatencyHistogram histogram;
  histogram.add(-1);
  EXPECT_EQ(histogram.quantile(0.5), 1e-6);
  for (int i = 0; i < 3; ++i) histogram.add(1e9);
  EXPECT_GT(histogram.quantile(0.5), 100);
  EXPECT_EQ(histogram.count(LatencyHistogram::kBuckets - 1), 3);
  EXPECT_EQ(histogram.total(), 4);
}

}  // namespace
}  // namespace alidade
