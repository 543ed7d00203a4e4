// What MotionDetector is made of: warp, spline, match, earlier frames, regions.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/detection/change_regions.h"
#include "core/detection/earlier_frames.h"
#include "core/detection/frame_match.h"
#include "core/detection/frame_warp.h"
#include "core/detection/spline_image.h"
#include "test/core/detection/panning_camera.h"

namespace alidade::test {
namespace {

FrameOrientation turned(double pan, double tilt, double rate) {
  Calibration calibration;
  // 7 % of distortion in the corners.
  calibration.camera = {21339, 1, {0.07 * 21339 * 21339 / (734.0 * 734.0)}, 1280, 720};
  calibration.line_delay = 25e-6;
  calibration.mechanics.tilt_axis = direction_plus(Vector3<double>(0, 1, 0), {0.01, 0.01});
  FrameMotion<double> motion;
  motion.angle = {pan, tilt};
  motion.rate = {rate, 0.2 * rate};
  motion.acceleration = {0.05, 0.02};
  FrameOrientation out;
  EXPECT_TRUE(make_frame_orientation(calibration, 0, OrientationMode::kOe, 1, motion,
                                     MotionCovariance::Zero(), Sensitivity<6>::Zero(), &out));
  return out;
}

TEST(FrameWarp, IsExactToATwentyFifthOfAPixelHalfAPictureAway) {
  FrameWarp warp(1280, 720);
  TileCorners corners(warp.corners());
  const FrameOrientation now = turned(0.03, 0.01, 0.03);
  const FrameOrientation then = turned(0.0, 0.005, -0.02);
  ASSERT_TRUE(warp.look(now));
  ASSERT_TRUE(warp.to(then, &corners));
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  double worst = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector2<double> u(1280 * uniform(random), 720 * uniform(random));
    Vector3<double> d;
    Vector2<double> exact;
    ASSERT_EQ(now.direction(u, &d), ProjectionStatus::kOk);
    ASSERT_EQ(then.pixel(d, &exact), ProjectionStatus::kOk);
    const int column = static_cast<int>(u.x() / kTile);
    const int row = static_cast<int>(u.y() / kTile);
    const double s = u.x() / kTile - column;
    const double t = u.y() / kTile - row;
    const auto at = [&](int a, int b) {
      const TileCorner& corner =
          corners[static_cast<std::size_t>((row + b) * (warp.columns() + 1) + column + a)];
      return Vector2<double>(static_cast<double>(corner.u), static_cast<double>(corner.v));
    };
    const Vector2<double> linear =
        (1 - t) * ((1 - s) * at(0, 0) + s * at(1, 0)) + t * ((1 - s) * at(0, 1) + s * at(1, 1));
    worst = std::max(worst, (linear - exact).norm());
  }
  EXPECT_LT(worst, 0.04);
}

TEST(FrameWarp, RefusesAFrameThatLooksElsewhere) {
  FrameWarp warp(1280, 720);
  TileCorners corners(warp.corners());
  ASSERT_TRUE(warp.look(turned(0, 0, 0)));
  EXPECT_FALSE(warp.to(turned(2.5, 0, 0), &corners));
}

TEST(SplineImage, IsTheSameAtPixelCentresAndNearlySoBetween) {
  std::mt19937_64 random(3);
  const AnalyticImage wave(&random, 3);
  const Pixels pixels = make_pixels(64, 48, wave, 0, &random);
  std::vector<std::uint16_t> smooth(64 * 48);
  smooth_image(pixels.view, smooth.data());
  for (int v = 2; v < 45; ++v) {
    for (int u = 2; u < 61; ++u) {
      const float here =
          spline_value(pixels.view, static_cast<float>(u) + 0.5F, static_cast<float>(v) + 0.5F);
      EXPECT_NEAR(here, smooth[static_cast<std::size_t>(64 * v + u)] / 36.0, 1e-4);
    }
  }
  // The outermost pixels are as they were.
  EXPECT_EQ(smooth[0], 36 * pixels.memory[0]);
}

TEST(FrameMatch, FindsShiftShearAndLight) {
  std::mt19937_64 random(4);
  const AnalyticImage wave(&random, 6);
  const Pixels now = make_pixels(256, 192, wave, 1, &random);
  const auto darker = [&](const Vector2<double>& u) {
    // Plus 0.4 px to the right in the last row, and to the left in the first.
    const double sheared = 0.4 * (2 * u.y() / 192 - 1);
    return 0.8 * wave(u + Vector2<double>(-0.6 - sheared, 0.35)) + 12;
  };
  const Pixels then = make_pixels(256, 192, darker, 1, &random);
  std::vector<std::uint16_t> smooth(256 * 192);
  smooth_image(now.view, smooth.data());
  constexpr int kColumns = 256 / kTile;
  constexpr int kRows = 192 / kTile;
  TileCorners same;
  for (int j = 0; j <= kRows; ++j) {
    for (int i = 0; i <= kColumns; ++i) {
      same.push_back({static_cast<float>(kTile * i), static_cast<float>(kTile * j)});
    }
  }
  std::vector<float> scratch(kColumns * kRows);
  DifferenceModel model;
  model.noise_square = 0.5F;
  model.shift_square = 0.01F;
  const FrameMatch match =
      match_frames({smooth.data(), 256, 192}, then.view, same, kColumns, kRows, model, &scratch);
  EXPECT_NEAR(match.shift.x(), 0.6, 0.05);
  EXPECT_NEAR(match.shift.y(), -0.35, 0.05);
  EXPECT_NEAR(match.shear.x(), 0.4, 0.05);
  EXPECT_NEAR(match.shear.y(), 0, 0.05);
  EXPECT_NEAR(match.gain, 1 / 0.8, 0.03);
  EXPECT_LT(match.spread, 1.5);
  EXPECT_GT(match.samples, 100);
}

TEST(EarlierFrames, KeepTheLatestAndALadderIntoThePast) {
  EarlierFrames frames(64, 64, 0.3);
  const Pixels image{std::vector<std::uint8_t>(64 * 64, 9), {}};
  FrameOrientation orientation;
  for (int i = 0; i <= 100; ++i) {
    orientation.time_s = 0.04 * i;
    EXPECT_TRUE(frames.after_all(orientation.time_s));
    frames.add({image.memory.data(), 64, 64, 64}, orientation);
    EXPECT_FALSE(frames.after_all(orientation.time_s));
  }
  frames.order_for(4.04);
  ASSERT_EQ(frames.size(), EarlierFrames::kMost);
  // First those at least 0.3 s old, the newest first, then the others, the oldest first.
  std::vector<double> ages;
  for (int i = 0; i < frames.size(); ++i) {
    ages.push_back(4.04 - frames.preferred(i).orientation.time_s);
    EXPECT_EQ(frames.view(i).row(63)[63], 9);
  }
  int old = 0;
  while (old < frames.size() && ages[static_cast<std::size_t>(old)] >= 0.3) ++old;
  EXPECT_GE(old, EarlierFrames::kLadder - 1);
  EXPECT_TRUE(std::is_sorted(ages.begin(), ages.begin() + old));
  for (int i = 1; i < old; ++i) {
    EXPECT_GE(ages[static_cast<std::size_t>(i)] - ages[static_cast<std::size_t>(i - 1)], 0.299);
  }
  EXPECT_TRUE(std::is_sorted(ages.begin() + old, ages.end(), std::greater<>()));
  EXPECT_NEAR(ages.back(), 0.04, 1e-9);
  frames.clear();
  EXPECT_EQ(frames.size(), 0);
}

class ChangeRegionsTest : public ::testing::Test {
 protected:
  static constexpr int kSize = 200;

  void plant(ChangeRegions* regions, int left, int top, int width, int height, double z) {
    for (int v = top; v < top + height; ++v) {
      std::fill_n(regions->z() + v * kSize + left, width,
                  static_cast<std::int16_t>(z * ChangeRegions::kUnit));
    }
  }

  ChangeOptions options_;
  ChangeRegions regions_{kSize, kSize, options_};
};

TEST_F(ChangeRegionsTest, ABoxIsWhatHasChanged) {
  plant(&regions_, 40, 50, 8, 6, 10);
  plant(&regions_, 120, 150, 5, 5, -4);
  ASSERT_TRUE(regions_.find());
  ASSERT_EQ(regions_.boxes().size(), 2U);
  const DetectionBox& strong = regions_.boxes()[0];
  EXPECT_EQ(strong.u, 40);
  EXPECT_EQ(strong.v, 50);
  EXPECT_EQ(strong.width, 8);
  EXPECT_EQ(strong.height, 6);
  const DetectionBox& weak = regions_.boxes()[1];
  EXPECT_EQ(weak.u, 120);
  EXPECT_EQ(weak.height, 5);
  // Held to 6, 25 of them, over 8.9.
  EXPECT_NEAR(strong.score, 25 * 6 / 8.889, 0.01);
  EXPECT_NEAR(weak.score, 25 * 4 / 8.889, 0.01);
}

TEST_F(ChangeRegionsTest, APieceHasTheSumThatItsBoxHas) {
  plant(&regions_, 40, 50, 8, 6, 4);
  ASSERT_TRUE(regions_.find());
  ASSERT_EQ(regions_.boxes().size(), 1U);
  EXPECT_NEAR(largest_sum(regions_.z(), kSize, kSize), regions_.boxes()[0].score, 1e-9);
  EXPECT_EQ(largest_sum(regions_.z(), 4, 100), 0);
}

TEST_F(ChangeRegionsTest, PiecesNearEachOtherAreOneThing) {
  plant(&regions_, 40, 50, 6, 6, 10);
  plant(&regions_, 50, 50, 6, 6, -10);
  plant(&regions_, 80, 50, 6, 6, 10);
  ASSERT_TRUE(regions_.find());
  EXPECT_EQ(regions_.boxes().size(), 2U);
}

// How near is near goes by the smaller one.
TEST_F(ChangeRegionsTest, ASmallPieceApartFromALargeOneIsAnotherThing) {
  plant(&regions_, 40, 50, 30, 30, 4);
  plant(&regions_, 78, 60, 5, 5, 4);
  ASSERT_TRUE(regions_.find());
  EXPECT_EQ(regions_.boxes().size(), 2U);
}

TEST_F(ChangeRegionsTest, TwoLargePiecesAreTwoThingsFromTwiceTheDistanceOn) {
  for (const int gap : {12, 13}) {
    ChangeRegions regions(kSize, kSize, options_);
    plant(&regions, 40, 50, 30, 30, 4);
    plant(&regions, 70 + gap, 55, 30, 30, 4);
    ASSERT_TRUE(regions.find());
    EXPECT_EQ(regions.boxes().size(), gap == 12 ? 1U : 2U);
  }
}

TEST_F(ChangeRegionsTest, ASinglePixelIsNothing) {
  plant(&regions_, 100, 100, 1, 1, 100);
  plant(&regions_, 20, 100, 3, 3, 1.5);
  ASSERT_TRUE(regions_.find());
  EXPECT_THAT(regions_.boxes(), ::testing::IsEmpty());
}

TEST_F(ChangeRegionsTest, KeepsTheSurestAndSaysWhenThereAreTooMany) {
  options_.most_boxes = 3;
  ChangeRegions few(kSize, kSize, options_);
  for (int i = 0; i < 5; ++i) plant(&few, 20 + 30 * i, 20, 5, 5, 3 + 0.5 * i);
  ASSERT_TRUE(few.find());
  ASSERT_EQ(few.boxes().size(), 3U);
  EXPECT_EQ(few.boxes()[0].u, 140);
  EXPECT_EQ(few.boxes()[2].u, 80);

  options_.merge_px = 0;
  ChangeRegions many(800, 800, options_);
  for (int v = 10; v + 10 < 800; v += 12) {
    for (int u = 10; u + 10 < 800; u += 12) {
      for (int k = 0; k < 16; ++k) many.z()[800 * (v + k / 4) + u + k % 4] = 100;
    }
  }
  EXPECT_FALSE(many.find());
  EXPECT_THAT(many.boxes(), ::testing::IsEmpty());
}

// As white noise seen through the B-spline: as often beyond 3 sigmas as a Gaussian is, 2.7e-3, each way and within what 40,000
// pixels of which neighbours share most of their noise can tell.
TEST_F(ChangeRegionsTest, NoiseIsNormalisedAsItIs) {
  std::mt19937_64 random(5);
  const auto flat = [](const Vector2<double>&) { return 120.0; };
  options_.threshold = 3;
  double changed = 0;
  constexpr int kRuns = 20;
  for (int run = 0; run < kRuns; ++run) {
    const Pixels image = make_pixels(kSize, kSize, flat, 10, &random);
    std::vector<std::uint16_t> smooth(kSize * kSize);
    smooth_image(image.view, smooth.data());
    ChangeRegions regions(kSize, kSize, options_);
    for (std::size_t i = 0; i < smooth.size(); ++i) {
      regions.z()[i] =
          static_cast<std::int16_t>(std::lround((smooth[i] / 36.0 - 120) / (10 * 0.5) * 16));
    }
    ASSERT_TRUE(regions.find());
    changed += regions.changed() / kRuns;
  }
  // 80,000 independent 5x5 sums at most and 32,000 at least: 2.7e-3 +- 4 of sqrt(2.7e-3 / 32,000).
  EXPECT_NEAR(changed, 2.7e-3, 4 * std::sqrt(2.7e-3 / 32000));
}

}  // namespace
}  // namespace alidade::test
