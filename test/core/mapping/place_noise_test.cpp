#include "core/mapping/place_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <utility>
#include <vector>

namespace alidade::test {
namespace {

using Errors = std::vector<std::pair<double, double>>;

// Norms of errors of two coordinates each.
void add_errors(double scale_px, double sigma_px, int count, std::mt19937* random, Errors* out) {
  std::normal_distribution<double> normal(0, sigma_px);
  for (int i = 0; i < count; ++i) {
    const double u = normal(*random);
    const double v = normal(*random);
    out->emplace_back(scale_px, std::hypot(u, v));
  }
}

TEST(PlaceNoise, GrowsWithTheFeatureWhileNothingIsKnown) {
  const PlaceNoise noise;
  for (double scale = 1; scale < 30; scale *= 1.3) {
    EXPECT_LE(noise.sigma_px(scale), noise.sigma_px(1.3 * scale)) << scale;
  }
  EXPECT_LT(noise.sigma_px(1.4), noise.sigma_px(14));
  EXPECT_EQ(noise.sigma_px(0), noise.sigma_px(1.4));
  EXPECT_EQ(noise.sigma_px(1e6), noise.sigma_px(1e3));
}

TEST(PlaceNoise, IsLearntThroughASeventhOfWrongOnes) {
  std::mt19937 random(3);
  Errors errors;
  add_errors(1.5, 0.05, 6000, &random, &errors);
  for (std::size_t i = 0; i < errors.size(); i += 7) errors[i].second = 20;
  PlaceNoise noise;
  noise.learn(errors);
  // The median of what is left moves to the quantile 0.583 of its own: by 1.124. Its sampling error is 0.94 % here; five of these.
  EXPECT_NEAR(noise.sigma_px(1.5), 1.124 * 0.05, 5 * 0.0094 * 1.124 * 0.05);
}

TEST(PlaceNoise, OfSizesThatFewHaveIsNoSharperThanOfSmallerOnes) {
  std::mt19937 random(4);
  Errors errors;
  add_errors(1.5, 3, 500, &random, &errors);
  add_errors(2.2, 0.1, 99, &random, &errors);
  PlaceNoise noise;
  const double before = noise.sigma_px(2.2);
  noise.learn(errors);
  EXPECT_GT(noise.sigma_px(1.5), before);
  EXPECT_EQ(noise.sigma_px(2.2), noise.sigma_px(1.5));
}

TEST(PlaceNoise, IsNeverNothing) {
  PlaceNoise noise;
  noise.learn(Errors(200, {1.5, 0.0}));
  EXPECT_EQ(noise.sigma_px(1.5), 0.01);
}

}  // namespace
}  // namespace alidade::test
