// The three kernels: values, gradients, margins, and what each costs the position of a wave.

#include "core/realtime/image/sampling.h"

#include <gtest/gtest.h>

#include <complex>
#include <limits>

#include "test/core/realtime/image/analytic_image.h"

namespace alidade::test {
namespace {

template <class Kernel>
class Sampling : public testing::Test {};
using Kernels = testing::Types<Bilinear, CatmullRom, CubicBSpline>;
TYPED_TEST_SUITE(Sampling, Kernels, );

TYPED_TEST(Sampling, IsExactOnARampAtPixelCoordinates) {
  std::mt19937_64 random(1);
  const Pixels pixels = make_pixels(
      20, 20, [](const Vector2<double>& at) { return 3 * at.x() + 5 * at.y() + 2; }, 0, &random);
  for (double u = 2.5; u < 17; u += 0.3) {
    for (double v = 2.5; v < 17; v += 0.3) {
      float value = 0;
      Vector2<float> gradient;
      ASSERT_EQ(sample<TypeParam>(pixels.view, u, v, &value, &gradient), SampleStatus::kOk);
      EXPECT_NEAR(value, 3 * u + 5 * v + 2, 1e-3);
      EXPECT_NEAR(gradient.x(), 3, 1e-4);
      EXPECT_NEAR(gradient.y(), 5, 1e-4);
    }
  }
}

TYPED_TEST(Sampling, GradientIsTheDerivativeOfTheValue) {
  std::mt19937_64 random(2);
  const AnalyticImage texture(&random);
  const Pixels pixels = make_pixels(20, 20, texture, 0, &random);
  // Fractions whose neighbours at +-h lie in the same square, where each kernel is a polynomial.
  constexpr double kH = 1.0 / 64;
  for (double u = 4.6; u < 15; u += 0.25) {
    for (double v = 4.6; v < 15; v += 0.25) {
      float value = 0;
      float after = 0;
      float before = 0;
      Vector2<float> gradient;
      ASSERT_EQ(sample<TypeParam>(pixels.view, u, v, &value, &gradient), SampleStatus::kOk);
      ASSERT_EQ(sample<TypeParam>(pixels.view, u + kH, v, &after), SampleStatus::kOk);
      ASSERT_EQ(sample<TypeParam>(pixels.view, u - kH, v, &before), SampleStatus::kOk);
      EXPECT_NEAR(gradient.x(), (after - before) / (2 * kH), 0.05);
      ASSERT_EQ(sample<TypeParam>(pixels.view, u, v + kH, &after), SampleStatus::kOk);
      ASSERT_EQ(sample<TypeParam>(pixels.view, u, v - kH, &before), SampleStatus::kOk);
      EXPECT_NEAR(gradient.y(), (after - before) / (2 * kH), 0.05);
    }
  }
}

// Sixteen taps one after the other, in double precision.
template <class Kernel>
double plain_sample(const ImageView& image, double u, double v) {
  constexpr int kTaps = Kernel::kTaps;
  TapPlace place{};
  EXPECT_EQ(find_taps<kTaps>(image, u, v, 1, 1, &place), SampleStatus::kOk);
  const auto across = Kernel::taps(place.t_u);
  const auto down = Kernel::taps(place.t_v);
  double value = 0;
  for (int j = 0; j < kTaps; ++j) {
    for (int i = 0; i < kTaps; ++i)
      value += static_cast<double>(down.weight[j]) * across.weight[i] *
               image.row(place.row + j)[place.column + i];
  }
  return value;
}

template <class Kernel>
class VectorSampling : public testing::Test {};
using FourTaps = testing::Types<CatmullRom, CubicBSpline>;
TYPED_TEST_SUITE(VectorSampling, FourTaps, );

TYPED_TEST(VectorSampling, EqualsTheScalarSumToTheRoundingOfFloats) {
  std::mt19937_64 random(4);
  const Pixels pixels = make_pixels(
      24, 24,
      [&](const Vector2<double>&) { return std::uniform_real_distribution<>(0, 255)(random); }, 0,
      &random);
  // Seven products and sums of floats, each off by half a unit in the last place at most, of terms whose
  // magnitudes add up to 255 times 1.25 squared at most, the kernels' largest sum of absolute weights.
  constexpr double kBound = 8 * 0.5 * std::numeric_limits<float>::epsilon() * 255 * 1.25 * 1.25;
  std::uniform_real_distribution<double> place(2, 21);
  for (int k = 0; k < 20000; ++k) {
    const double u = place(random);
    const double v = place(random);
    float value = 0;
    ASSERT_EQ(sample<TypeParam>(pixels.view, u, v, &value), SampleStatus::kOk);
    ASSERT_NEAR(value, plain_sample<TypeParam>(pixels.view, u, v), kBound) << u << ", " << v;
  }
}

TYPED_TEST(Sampling, RefusesPointsWhoseTapsLeaveTheImage) {
  std::mt19937_64 random(3);
  const Pixels pixels = make_pixels(
      9, 7, [](const Vector2<double>&) { return 5.0; }, 0, &random);
  const double margin = 0.5 * (TypeParam::kTaps - 1);
  float value = 0;
  const auto status = [&](double u, double v) {
    return sample<TypeParam>(pixels.view, u, v, &value);
  };
  EXPECT_EQ(status(margin, margin), SampleStatus::kOk);
  EXPECT_EQ(status(9 - margin - 1e-6, 7 - margin - 1e-6), SampleStatus::kOk);
  for (const double beyond : {-1e300, -5.0, margin - 1e-6, 9 - margin + 1e-6, 1e300,
                              std::numeric_limits<double>::infinity(), std::nan("")}) {
    EXPECT_EQ(status(beyond, 3.5), SampleStatus::kOutsideMargin) << beyond;
    EXPECT_EQ(status(4.5, beyond), SampleStatus::kOutsideMargin) << beyond;
  }
  EXPECT_EQ(status(4.5, 7 - margin + 1e-6), SampleStatus::kOutsideMargin);
}

// By how much a wave of a given period seems displaced when a kernel looks at it at a fraction of a pixel:
// the phase of sum_k w_k(t) exp(i omega k) against that of exp(i omega t); the worst fraction.
template <class Kernel>
double worst_displacement(double period) {
  const double omega = 2 * std::acos(-1.0) / period;
  double worst = 0;
  for (double t = 0; t < 1; t += 0.01) {
    const auto taps = Kernel::taps(static_cast<float>(t));
    std::complex<double> sum = 0;
    for (int k = 0; k < Kernel::kTaps; ++k) {
      sum += static_cast<double>(taps.weight[k]) *
             std::polar(1.0, omega * (k - (Kernel::kTaps / 2 - 1) - t));
    }
    worst = std::max(worst, std::abs(std::arg(sum)) / omega);
  }
  return worst;
}

TEST(SamplingDisplacement, IsSmallestForTheSplineThatBlurs) {
  for (const double period : {4.0, 6.0, 8.0, 12.0}) {
    const double bilinear = worst_displacement<Bilinear>(period);
    const double catmull_rom = worst_displacement<CatmullRom>(period);
    const double spline = worst_displacement<CubicBSpline>(period);
    RecordProperty("period_" + std::to_string(static_cast<int>(period)),
                   std::to_string(bilinear) + " " + std::to_string(catmull_rom) + " " +
                       std::to_string(spline));
    EXPECT_LT(spline, catmull_rom);
    EXPECT_LT(spline, bilinear / 5);
  }
  EXPECT_LT(worst_displacement<CubicBSpline>(4), 0.01);
}

}  // namespace
}  // namespace alidade::test
