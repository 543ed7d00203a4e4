#include "core/calibration/motion_match.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace alidade::internal {
namespace {

constexpr double kFocalLength = 3000;  // px
constexpr double kShift = 0.37;        // s

PanTilt<double> angle_at(double t) {
  return {0.3 * std::sin(0.9 * t) + 0.05 * t, 0.1 * std::cos(1.7 * t)};
}

// Telemetry of angle_at from 0 s to 12 s, on its own clock.
TrajectorySpline telemetry() {
  std::vector<double> knots;
  for (int i = 0; i <= 240; ++i) knots.push_back(0.05 * i);
  TrajectorySpline spline(knots);
  for (int i = 0; i < spline.control_points(); ++i) {
    spline.control_point(i) = angle_at(0.05 * (i - 1)).vector();
  }
  return spline;
}

// Landmarks in 15 frames a second whose image moves as the mount turns, by small angles.
AdjustmentData tracks() {
  AdjustmentData data;
  for (int f = 0; f < 150; ++f) data.frame_time_s.push_back(1 + f / 15.0);
  for (int l = 0; l < 20; ++l) {
    for (int f = 0; f < 150; ++f) {
      const PanTilt<double> angle =
          angle_at(data.frame_time_s[static_cast<std::size_t>(f)] + kShift);
      const Vector2<double> u(-kFocalLength * angle.pan, kFocalLength * angle.tilt);
      data.observations.push_back({l, f, u + Vector2<double>(40.0 * l, 20.0 * l), 0.3, true});
    }
  }
  return data;
}

TEST(MotionMatch, FindsClockOffsetAndFocalLengthWithoutAGuess) {
  const auto motion = image_motion(tracks(), 0.5);
  ASSERT_GT(motion.size(), 100u);
  for (const ImageMotion& m : motion) EXPECT_NEAR(m.to_s - m.from_s, 0.5, 1 / 15.0);
  const MotionMatch match = match_motion(motion, telemetry(), 0, 1);
  EXPECT_FALSE(match.at_edge);
  EXPECT_GT(match.correlation, 0.999);
  EXPECT_NEAR(match.shift_s, kShift, 2e-3);
  // cos(tilt) of 0.1 rad at most: half a percent.
  EXPECT_NEAR(match.focal_length, kFocalLength, 0.01 * kFocalLength);
}

// As in a long recording, of which every third frame is used; a step of 0.5 s ends at another one.
TEST(MotionMatch, FramesWithoutObservationsMayLieBetween) {
  AdjustmentData data = tracks();
  auto& seen = data.observations;
  seen.erase(std::remove_if(seen.begin(), seen.end(),
                            [](const AdjustmentObservation& o) { return o.frame % 3 != 0; }),
             seen.end());
  const auto motion = image_motion(data, 0.5);
  ASSERT_GT(motion.size(), 40u);
  for (const ImageMotion& m : motion) EXPECT_NEAR(m.to_s - m.from_s, 0.6, 1e-9);
  const MotionMatch match = match_motion(motion, telemetry(), 0, 1);
  EXPECT_NEAR(match.shift_s, kShift, 2e-3);
  EXPECT_NEAR(match.focal_length, kFocalLength, 0.01 * kFocalLength);
}

// 60 degrees up the image moves by half of the way in pan.
TEST(MotionMatch, PanMovesTheImageByTheCosineOfTheTilt) {
  TrajectorySpline high = telemetry();
  for (int i = 0; i < high.control_points(); ++i) high.control_point(i)[1] += kPi / 3;
  std::vector<ImageMotion> motion;
  for (double t = 1; t < 10; t += 0.1) {
    const PanTilt<double> from = high.position(t + kShift);
    const PanTilt<double> to = high.position(t + 0.2 + kShift);
    const double width = std::cos(0.5 * (from.tilt + to.tilt));
    motion.push_back(
        {t,
         t + 0.2,
         {-kFocalLength * width * (to.pan - from.pan), kFocalLength * (to.tilt - from.tilt)}});
  }
  EXPECT_NEAR(match_motion(motion, high, 0, 1).focal_length, kFocalLength, 1e-3 * kFocalLength);
}

// The best there is grows beyond the range, also where it is looked for more finely.
TEST(MotionMatch, SaysWhereTheRangeCutsItOff) {
  const auto motion = image_motion(tracks(), 0.5);
  for (const double range : {0.1, 0.2, 0.3}) {
    EXPECT_TRUE(match_motion(motion, telemetry(), 0, range).at_edge) << range;
    EXPECT_TRUE(match_motion(motion, telemetry(), 2 * kShift, range).at_edge) << range;
    EXPECT_FALSE(match_motion(motion, telemetry(), kShift - 0.05, range).at_edge) << range;
  }
}

// A third of the tracks is wild: the median does not see them.
TEST(MotionMatch, MediansDoNotSeeWildTracks) {
  AdjustmentData data = tracks();
  for (auto& o : data.observations) {
    if (o.landmark % 3 == 0) o.u.x() = 37.0 * ((o.frame * 7919 + o.landmark) % 50);
  }
  const MotionMatch match = match_motion(image_motion(data, 0.5), telemetry(), 0, 1);
  EXPECT_NEAR(match.shift_s, kShift, 5e-3);
  EXPECT_NEAR(match.focal_length, kFocalLength, 0.02 * kFocalLength);
}

// Where no three landmarks go on from a frame to the next, nothing is said across.
TEST(ImageMotion, EndsAtABreakOfTheTracksAndNotAtAnEmptyFrame) {
  AdjustmentData data = tracks();
  AdjustmentData broken = data;
  broken.observations.clear();
  AdjustmentData empty = broken;
  for (const auto& o : data.observations) {
    if (o.frame != 70) empty.observations.push_back(o);
    auto named = o;
    if (o.frame >= 70) named.landmark += 20;
    broken.observations.push_back(named);
  }
  bool crosses = false;
  for (const auto& m : image_motion(empty, 0.5)) {
    crosses = crosses || (m.from_s < data.frame_time_s[70] && m.to_s > data.frame_time_s[70]);
  }
  EXPECT_TRUE(crosses);
  for (const auto& m : image_motion(broken, 0.5)) {
    EXPECT_FALSE(m.from_s < data.frame_time_s[70] && m.to_s >= data.frame_time_s[70]);
  }
}

}  // namespace
}  // namespace alidade::internal
