#include "core/realtime/start_up/smooth_flow.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "core/model/lens/camera.h"
#include "core/model/rotation.h"

namespace alidade::test {
namespace {

constexpr int kFlowWidth = 1920;
constexpr int kFlowHeight = 1080;

// 60 degrees wide, k r^2 = 7 % in the corners.
Camera<double> wide_camera() {
  Camera<double> camera;
  camera.width = kFlowWidth;
  camera.height = kFlowHeight;
  camera.focal_length = 0.5 * kFlowWidth / std::tan(0.5 * 1.0472);
  const double corner = 0.5 * std::hypot(kFlowWidth, kFlowHeight) / camera.focal_length;
  camera.distortion.radial = 0.07 / (corner * corner);
  return camera;
}

// How a camera that turns by a rotation vector (camera frame) moves a pixel.
Vector2<double> motion(const Camera<double>& camera, const Vector3<double>& turn,
                       const Vector2<double>& u) {
  Vector3<double> d = Vector3<double>::Zero();
  Vector2<double> moved = Vector2<double>::Zero();
  EXPECT_EQ(unproject(camera, u, &d), ProjectionStatus::kOk);
  EXPECT_EQ(project(camera, Vector3<double>(exp_so3(turn) * d), &moved), ProjectionStatus::kOk);
  return moved - u;
}

std::vector<FlowSample> samples_of(const Vector3<double>& turn, int count, double sigma,
                                   std::mt19937_64* random) {
  std::uniform_real_distribution<double> uniform(0.02, 0.98);
  std::normal_distribution<double> normal(0, 1);
  std::vector<FlowSample> samples;
  for (int i = 0; i < count; ++i) {
    const Vector2<double> u(kFlowWidth * uniform(*random), kFlowHeight * uniform(*random));
    const Vector2<double> noise(normal(*random), normal(*random));
    samples.push_back({u, motion(wide_camera(), turn, u) + sigma * noise});
  }
  return samples;
}

// About y (to the side), x and z; 77 px in the image centre.
const Vector3<double> kTurn(0.01, 0.045, 0.01);

double largest_error(const SmoothFlow& flow, const Vector3<double>& turn) {
  double largest = 0;
  for (double v = 0; v <= kFlowHeight; v += kFlowHeight / 8.0) {
    for (double u = 0; u <= kFlowWidth; u += kFlowWidth / 8.0) {
      const Vector2<double> expected = motion(wide_camera(), turn, {u, v});
      largest = std::max(largest, (flow.at({u, v}) - expected).norm());
    }
  }
  return largest;
}

TEST(SmoothFlow, HoldsTheMotionOfAWideDistortedLens) {
  std::mt19937_64 random(1);
  const std::vector<FlowSample> samples = samples_of(kTurn, 200, 0, &random);
  SmoothFlow flow(kFlowWidth, kFlowHeight, 200);
  flow.set_uniform({-60, 10});
  const double left_over = flow.fit(samples.data(), 200, 0.05);
  EXPECT_LT(left_over, 0.1);
  EXPECT_LT(largest_error(flow, kTurn), 0.5);
}

TEST(SmoothFlow, GradientIsTheDerivative) {
  std::mt19937_64 random(2);
  const std::vector<FlowSample> samples = samples_of(kTurn, 200, 0, &random);
  SmoothFlow flow(kFlowWidth, kFlowHeight, 200);
  (void)flow.fit(samples.data(), 200, 0.05);
  for (const Vector2<double>& u :
       {Vector2<double>(0, 0), Vector2<double>(1800, 300), Vector2<double>(960, 540)}) {
    constexpr double kStep = 1e-2;
    Matrix2<double> numeric;
    numeric.col(0) =
        flow.at(u + Vector2<double>(kStep, 0)) - flow.at(u - Vector2<double>(kStep, 0));
    numeric.col(1) =
        flow.at(u + Vector2<double>(0, kStep)) - flow.at(u - Vector2<double>(0, kStep));
    numeric /= 2 * kStep;
    EXPECT_LT((flow.gradient(u) - numeric).norm(), 1e-9);
    EXPECT_GT(numeric.norm(), 1e-3);
  }
}

TEST(SmoothFlow, LeavesOutWhatMovesByItself) {
  std::mt19937_64 random(3);
  std::vector<FlowSample> samples = samples_of(0.1 * kTurn, 200, 0.1, &random);
  int by_itself = 0;
  for (FlowSample& sample : samples) {
    const double x = sample.at.x() / kFlowWidth;
    const double y = sample.at.y() / kFlowHeight;
    if (!(x > 0.7 && y > 0.4) && !(x < 0.2 && y < 0.6)) continue;
    sample.moved += Vector2<double>(6, 1);
    ++by_itself;
  }
  ASSERT_GT(by_itself, 50);
  SmoothFlow flow(kFlowWidth, kFlowHeight, 200);
  flow.set_uniform({-8, 1});
  EXPECT_LT(flow.fit(samples.data(), 200, 0.05), 0.2);
  // Where it has samples to stand on; elsewhere it is free to bend.
  for (double x = 0.25; x < 0.7; x += 0.1) {
    const Vector2<double> u(x * kFlowWidth, 0.5 * kFlowHeight);
    EXPECT_LT((flow.at(u) - motion(wide_camera(), 0.1 * kTurn, u)).norm(), 0.2) << x;
  }
}

TEST(SmoothFlow, SaysHowMuchIsLeftOver) {
  std::mt19937_64 random(4);
  constexpr int kRuns = 25;
  double mean = 0;
  for (int run = 0; run < kRuns; ++run) {
    const std::vector<FlowSample> samples = samples_of(0.1 * kTurn, 250, 0.5, &random);
    SmoothFlow flow(kFlowWidth, kFlowHeight, 250);
    mean += flow.fit(samples.data(), 250, 0.05) / kRuns;
  }
  // 240 degrees of freedom of 250, and the median's own error: 8 % of a run.
  EXPECT_NEAR(mean, 0.5 * std::sqrt(240.0 / 250), 4 * 0.04 / std::sqrt(kRuns));
}

TEST(SmoothFlow, IsTheSameEverywhereOnceItIsUniform) {
  std::mt19937_64 random(7);
  const std::vector<FlowSample> samples = samples_of(kTurn, 200, 0, &random);
  SmoothFlow flow(kFlowWidth, kFlowHeight, 200);
  (void)flow.fit(samples.data(), 200, 0.05);
  flow.set_uniform({3, -4});
  for (const Vector2<double>& u : {Vector2<double>(0, 0), Vector2<double>(1800, 300)}) {
    EXPECT_EQ(flow.at(u), Vector2<double>(3, -4));
    EXPECT_EQ(flow.gradient(u).norm(), 0);
  }
}

// Samples so near the centre that they know a slope to the standard deviation that it has before them: thrice
// the motion, which counts as 4 px at least, over half the width. Each has half a say.
TEST(SmoothFlow, WeighsASlopeAgainstWhatIsKnownOfItBefore) {
  constexpr int kCount = 20;
  constexpr double kSigma = 1;    // px
  constexpr double kBefore = 12;  // px
  constexpr double kSlope = 4;    // px over half the width
  // Of a sum over n places, evenly from -d to d.
  const double d = kSigma / kBefore * std::sqrt(3.0 * (kCount - 1) / (kCount * (kCount + 1)));
  std::vector<FlowSample> samples;
  for (int i = 0; i < kCount; ++i) {
    const double x = d * (2.0 * i / (kCount - 1) - 1);
    samples.push_back(
        {Vector2<double>(0.5 * kFlowWidth * (1 + x), 0.5 * kFlowHeight), {kSlope * x, 0}});
  }
  SmoothFlow flow(kFlowWidth, kFlowHeight, kCount);
  flow.set_uniform({0, 0});
  (void)flow.fit(samples.data(), kCount, kSigma);
  const double found =
      flow.gradient({0.5 * kFlowWidth, 0.5 * kFlowHeight})(0, 0) * 0.5 * kFlowWidth;
  EXPECT_NEAR(found, kSlope / 2, 0.1 * kSlope);
}

TEST(SmoothFlow, StaysAsItIsWithTooFewSamples) {
  std::mt19937_64 random(5);
  const std::vector<FlowSample> samples = samples_of(kTurn, 3, 0, &random);
  SmoothFlow flow(kFlowWidth, kFlowHeight, 10);
  flow.set_uniform({1, 2});
  EXPECT_EQ(flow.fit(samples.data(), 3, 0.05), std::numeric_limits<double>::infinity());
  EXPECT_EQ(flow.at({100, 900}), Vector2<double>(1, 2));
}

// Samples in one corner do not throw the other one far.
TEST(SmoothFlow, BendsLittleBeyondItsSamples) {
  std::mt19937_64 random(6);
  std::vector<FlowSample> samples = samples_of(0.1 * kTurn, 40, 0.1, &random);
  for (FlowSample& sample : samples) {
    sample.at *= 0.2;
    sample.moved = motion(wide_camera(), 0.1 * kTurn, sample.at) + Vector2<double>(0.1, 0);
  }
  SmoothFlow flow(kFlowWidth, kFlowHeight, 40);
  (void)flow.fit(samples.data(), 40, 0.1);
  EXPECT_LT(largest_error(flow, 0.1 * kTurn), 30);
}

}  // namespace
}  // namespace alidade::test
