// What is said of a video of a pattern while it is taken: where all was shown, a calibration is sharp; where something lacks, that is
// said and nothing that is there.
#include "core/pattern/pattern_progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "core/model/rotation.h"
#include "core/pattern/calibrate_pattern.h"
#include "core/pattern/image_cells.h"
#include "core/pattern/pattern_view.h"
#include "test/core/pattern/pattern_simulation.h"

namespace alidade {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

// Moves as a person who was told how.
test::PatternScene shown_well(std::uint64_t seed) {
  test::PatternScene scene;
  scene.seed = seed;
  scene.duration_s = 22;
  scene.rate_hz = 15;
  scene.noise_px = 0.1;
  scene.hand.amplitude = {{2, 2, 1, 1.2, 1.2, 1.2}};
  return scene;
}

PatternData first_seconds(PatternData data, double seconds) {
  while (!data.frames.empty() && data.frames.back().time_s > seconds) data.frames.pop_back();
  return data;
}

TEST(PatternProgress, WhatIsEnoughCalibratesSharply) {
  for (const std::uint64_t seed : {1U, 2U}) {
    const test::PatternScene scene = shown_well(seed);
    const PatternData data = test::simulate_pattern(scene);
    const PatternProgress progress = progress_of(data);
    EXPECT_THAT(advice_of(progress), IsEmpty());
    ASSERT_TRUE(is_enough(progress));
    EXPECT_FALSE(is_enough(progress_of(first_seconds(data, 10))));
    const PatternCalibration calibration = calibrate_pattern(data);
    ASSERT_EQ(calibration.status, PatternStatus::kOk) << calibration.message;
    const LensVector truth = test::truth_of(scene.lens);
    // An eighth of what is refused.
    const PatternCalibrationOptions limits;
    EXPECT_LT(calibration.sigma(LensParameter::kFocalLengthU) / truth[0],
              limits.largest_focal_length_sigma / 8);
    EXPECT_LT(calibration.sigma(LensParameter::kLineDelay) * scene.height,
              limits.largest_readout_sigma_s / 4);
    for (const LensParameter parameter :
         {LensParameter::kFocalLengthU, LensParameter::kCentreV, LensParameter::kLineDelay}) {
      EXPECT_LT(std::abs(calibration.lens[index(parameter)] - truth[index(parameter)]),
                5 * calibration.sigma(parameter));
    }
  }
}

TEST(PatternProgress, WhatLacksIsSaidAndNothingElse) {
  struct Case {
    const char* what;
    void (*spoil)(test::PatternScene*);
  };
  for (const auto& [what, spoil] :
       {Case{"tilt it by 30 to 45 degrees, with each of these sides nearer: left, right, upper, "
             "lower",
             [](test::PatternScene* scene) {
               for (std::size_t i = 3; i < 6; ++i) scene->hand.amplitude[i] = 0.2;
             }},
        {"show it nearer and farther",
         [](test::PatternScene* scene) { scene->hand.amplitude[2] = 0.1; }},
        {"parts of the image: upper left, upper right, left, right, lower left, bottom, lower "
         "right",
         [](test::PatternScene* scene) {
           scene->hand.amplitude[0] = scene->hand.amplitude[1] = 0.1;
           scene->square_m = 0.022;
           scene->speed = 2;
         }},
        {"go nearer",
         [](test::PatternScene* scene) {
           scene->square_m = 0.017;
           scene->hand.amplitude[0] = scene->hand.amplitude[1] = 2.4;
           scene->duration_s = 44;
         }},
        {"the image moves too far", [](test::PatternScene* scene) { scene->speed = 4; }}}) {
    test::PatternScene scene = shown_well(1);
    spoil(&scene);
    const PatternProgress progress = progress_of(test::simulate_pattern(scene));
    EXPECT_THAT(advice_of(progress), ::testing::ElementsAre(HasSubstr(what)));
    EXPECT_FALSE(is_enough(progress)) << what;
  }
}

TEST(PatternProgress, HowMuchTooFastItMovesIsSaid) {
  PatternProgress progress = progress_of(test::simulate_pattern(shown_well(1)));
  // 2^4 times what may be: twice the speed.
  progress.unfollowed = 15.9 * 0.025;
  EXPECT_THAT(advice_of(progress), ::testing::ElementsAre(HasSubstr("at 50 % of this speed")));
  progress.unfollowed = 1.01 * 0.025;
  EXPECT_THAT(advice_of(progress), ::testing::ElementsAre(HasSubstr("at 90 % of this speed")));
  progress.found = 0.3;
  EXPECT_THAT(advice_of(progress), ::testing::ElementsAre(HasSubstr("few images, 30 % of them")));
}

// As far as before, in four times the time, and held still in between.
TEST(PatternProgress, MotionThatIsTooSlowIsSaid) {
  test::PatternScene scene = shown_well(1);
  scene.speed = 0.15;
  scene.duration_s = 40;
  scene.rate_hz = 10;
  const PatternProgress progress = progress_of(test::simulate_pattern(scene));
  EXPECT_THAT(advice_of(progress),
              Contains(HasSubstr("move the camera faster, in all directions")));
  EXPECT_FALSE(is_enough(progress));
}

TEST(PatternProgress, APatternThatIsNotFoundIsAllThatIsSaid) {
  PatternData data = test::simulate_pattern(shown_well(1));
  for (PatternFrame& frame : data.frames) {
    if (frame.time_s > 12.01) frame.observations.clear();
  }
  const std::vector<std::string> lost = advice_of(progress_of(data));
  ASSERT_FALSE(lost.empty());
  EXPECT_THAT(lost.front(), HasSubstr("last found at 12 s; is it this pattern"));
  for (PatternFrame& frame : data.frames) frame.observations.clear();
  EXPECT_THAT(advice_of(progress_of(data)),
              ::testing::ElementsAre(HasSubstr("the pattern is not found; is it this pattern")));
  EXPECT_FALSE(is_enough(progress_of(data)));
  EXPECT_FALSE(is_enough(progress_of(PatternData())));
}

// What was shown stays shown, and is enough whatever is seen now.
TEST(PatternProgress, APatternThatLeavesInTheEndTakesNothingBack) {
  PatternData data = test::simulate_pattern(shown_well(2));
  const PatternProgress before = progress_of(data);
  for (int i = 0; i < 100; ++i) data.frames.push_back({data.frames.back().time_s + 0.05, {}});
  const PatternProgress after = progress_of(data);
  EXPECT_TRUE(is_enough(before) && is_enough(after));
  EXPECT_EQ(after.covered, before.covered);
  EXPECT_EQ(after.seen_s, before.seen_s);
  EXPECT_NEAR(after.unseen_s, 5, 0.06);
}

TEST(PatternProgress, FewImagesWithThePatternAreSaid) {
  PatternData data = test::simulate_pattern(shown_well(1));
  for (std::size_t f = 0; f < data.frames.size(); ++f) {
    if (f % 4 != 0) data.frames[f].observations.clear();
  }
  EXPECT_THAT(advice_of(progress_of(data)), Contains(HasSubstr("found in few images")));
}

// One point that moves as it is told.
template <class Motion>
PatternData moving_point(const std::vector<double>& times, const Motion& motion) {
  PatternData data;
  data.width = data.height = 100;
  data.points_m.emplace_back(0, 0, 0);
  for (const double time_s : times) data.frames.push_back({time_s, {{0, motion(time_s)}}});
  return data;
}

TEST(PatternProgress, FramesFollowACubicAndMissASineAsItsFrequencySays) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<double> uneven = {0};
  while (uneven.size() < 60) uneven.push_back(uneven.back() + 0.03 + 0.02 * uniform(random));
  const auto cubic = [](double t) {
    return Vector2<double>(50 + t * (3 - t * (7 - 2 * t)), 20 - t * t * t);
  };
  EXPECT_NEAR(unfollowed_motion(moving_point(uneven, cubic), -1), 0, 1e-12);

  std::vector<double> even;
  for (int i = 0; i < 400; ++i) even.push_back(0.05 * i);
  for (const double w : {0.3, 1.0, 2.5}) {  // rad a frame
    const auto circle = [w](double t) {
      return Vector2<double>(50 + 30 * std::sin(w * t / 0.05), 50 + 30 * std::cos(w * t / 0.05));
    };
    const double missed = std::abs(1 - (8 * std::cos(w) - 2 * std::cos(2 * w)) / 6);
    EXPECT_NEAR(unfollowed_motion(moving_point(even, circle), -1), 0.3 * missed, 1e-9) << w;
  }
}

TEST(PatternProgress, AGapIsNoMotion) {
  std::vector<double> times;
  for (int i = 0; i < 40; ++i) times.push_back(0.05 * i + (i < 20 ? 0 : 5));
  const auto jump = [](double t) { return Vector2<double>(t < 3 ? 20 : 80, 50); };
  const PatternData data = moving_point(times, jump);
  EXPECT_NEAR(unfollowed_motion(data, -1), 0, 1e-12);
  const PatternProgress progress = progress_of(data);
  EXPECT_EQ(progress.speed, 0);
  EXPECT_NEAR(progress.seen_s, 38 * 0.05, 1e-9);
}

TEST(PatternView, TiltIsByTheSideThatIsNearer) {
  for (const double angle : {-0.6, 0.4}) {
    for (const int axis : {0, 1}) {
      Vector3<double> phi = Vector3<double>::Zero();
      phi[axis] = angle;
      const Matrix3<double> R_camera_from_pattern = exp_so3(phi);
      const Vector3<double> in_camera(0.1, -0.2, 0.7);  // the pattern's middle
      const Vector3<double> middle(0.12, 0.07, 0);
      const Vector3<double> centre = middle - R_camera_from_pattern.transpose() * in_camera;
      const PatternView view = pattern_view(R_camera_from_pattern.transpose(), centre, middle);
      EXPECT_NEAR(view.distance_m, in_camera.norm(), 1e-12);
      const Vector3<double> right = R_camera_from_pattern * Vector3<double>::UnitX();
      const Vector3<double> down = R_camera_from_pattern * Vector3<double>::UnitY();
      EXPECT_NEAR(std::abs(view.tilt[1 - axis]), std::abs(angle), 1e-12);
      EXPECT_EQ(view.tilt.x() > 1e-9, right.z() < -1e-9);
      EXPECT_EQ(view.tilt.y() > 1e-9, down.z() < -1e-9);
      EXPECT_NEAR(view.tilt[axis], 0, 1e-12);
    }
  }
}

TEST(ImageCells, EachPointLiesInItsCell) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (const auto& [width, height] :
       {std::pair(752, 480), {480, 752}, {33, 32}, {1920, 1080}, {4000, 40}}) {
    const ImageCells cells(width, height);
    double area = 0;
    for (int cell = 0; cell < cells.count(); ++cell)
      area += (cells.high(cell) - cells.low(cell)).prod();
    EXPECT_NEAR(area, static_cast<double>(width) * height, 1e-6);
    for (int i = 0; i < 200; ++i) {
      const Vector2<double> u(width * uniform(random), height * uniform(random));
      const int cell = cells.cell_of(u);
      EXPECT_TRUE(((u - cells.low(cell)).array() >= -1e-9).all() &&
                  ((cells.high(cell) - u).array() >= -1e-9).all());
    }
    EXPECT_EQ(cells.cell_of({-5, -5}), 0);
    EXPECT_EQ(cells.cell_of({width + 5.0, height + 5.0}), cells.count() - 1);
  }
}

}  // namespace
}  // namespace alidade
