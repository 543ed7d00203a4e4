// The noise of an image, from the image alone: whatever else it shows.

#include "core/realtime/image/image_noise.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "test/core/realtime/image/analytic_image.h"

namespace alidade::test {
namespace {

constexpr int kNoisyWidth = 160;
constexpr int kNoisyHeight = 120;

template <class GreyAt>
double noise_of(const GreyAt& grey_at, double sigma) {
  std::mt19937_64 random(1);
  const Pixels pixels = make_pixels(kNoisyWidth, kNoisyHeight, grey_at, sigma, &random);
  std::vector<float> scratch(4096);
  return image_noise(pixels.view, scratch.data(), static_cast<int>(scratch.size()));
}

// A quantile of some 4000 values is known to 3 %.
constexpr double kTolerance = 4 * 0.03;

TEST(ImageNoise, IsWhatAnImageWithoutATextureShows) {
  for (const double sigma : {1.0, 3.0, 8.0}) {
    const double expected = std::sqrt(sigma * sigma + 1.0 / 12);  // rounding
    const auto flat = [](const Vector2<double>&) { return 100.0; };
    EXPECT_NEAR(noise_of(flat, sigma), expected, kTolerance * expected);
    const auto light = [](const Vector2<double>& at) {
      return 40 + at.x() - 0.4 * at.y() + 0.008 * (at - Vector2<double>(80, 60)).squaredNorm();
    };
    EXPECT_NEAR(noise_of(light, sigma), expected, kTolerance * expected);
  }
}

TEST(ImageNoise, IsThatOfTheSmoothPartsOfATexturedImage) {
  std::mt19937_64 random(2);
  const AnalyticImage texture(&random, 15);
  const auto half = [&](const Vector2<double>& at) {
    return at.x() < 0.5 * kNoisyWidth ? texture(at) : 128;
  };
  constexpr double kSigma = 3;
  const double found = noise_of(half, kSigma);
  EXPECT_GT(found, kSigma);
  // A quarter of all is half of what is smooth: |N(0, 1)| is below 0.674 so often, not below 0.319.
  EXPECT_LT(found, 0.674 / 0.319 * kSigma * (1 + kTolerance));
}

TEST(ImageNoise, IsNeverLessThanRounding) {
  const auto flat = [](const Vector2<double>&) { return 100.0; };
  EXPECT_NEAR(noise_of(flat, 0), std::sqrt(1.0 / 12), 0.01);
}

}  // namespace
}  // namespace alidade::test
