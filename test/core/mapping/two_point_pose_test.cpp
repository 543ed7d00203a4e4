#include "core/mapping/two_point_pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/model/nearest_angles.h"
#include "test/core/mapping/seen_picture.h"

namespace alidade::test {
namespace {

PoseMatch exact_match(const SeenPicture& picture, const Eigen::Vector2d& u) {
  PoseMatch out;
  out.u = u;
  out.d_b = picture.direction_of(u);
  return out;
}

// At rest, where both models of a read-out are the same.
TEST(TwoPointPose, UndoesTheCameraEverywhere) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> part(0, 1);
  for (const double f : {1200.0, 24000.0}) {
    for (const double pan : {-kPi, -kPi + 1e-9, -1.0, 0.0, kPi - 1e-9}) {
      for (const double tilt : {-kPi / 2 + 1e-4, -0.7, 0.0, kPi / 2 - 1e-4, kPi / 2}) {
        SeenPicture picture = lively_picture(f, pan, tilt, 0);
        picture.zoom_rate = 0.2;
        const PoseKnowledge knowledge = picture.knowledge(true);
        for (int i = 0; i < 20; ++i) {
          const Eigen::Vector2d a(1280 * part(random), 720 * part(random));
          const Eigen::Vector2d b(1280 * part(random), 720 * part(random));
          const double apart_px = (a - b).norm();
          if (apart_px < 20) continue;
          const auto pose =
              internal::two_point_pose(exact_match(picture, a), exact_match(picture, b), knowledge);
          ASSERT_TRUE(pose) << f << " " << pan << " " << tilt << " " << apart_px;
          // Rounding of a direction, 1e-16 rad, by the angle between both.
          const double allowed = 1e-14 * f / apart_px + 1e-10;
          EXPECT_NEAR(pose->log_f, std::log(f), 10 * allowed);
          EXPECT_LT((pose->R_base_from_camera - picture.base_from_camera(0)).norm(), 10 * allowed);
          const NearestAngles nearest =
              nearest_angles(*knowledge.mechanics, pose->R_base_from_camera);
          EXPECT_LT(nearest.off, 20 * allowed);
          // About the pole pan turns the picture about its axis: only the orientation is determined.
          EXPECT_LT((R_base_from_camera(*knowledge.mechanics, nearest.angle) -
                     picture.base_from_camera(0))
                        .norm(),
                    30 * allowed);
        }
      }
    }
  }
}

TEST(TwoPointPose, KnowsTheReadOut) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> part(0, 1);
  for (const double f : {1200.0, 24000.0}) {
    const SeenPicture picture = lively_picture(f, 2.5, 0.4, 0.5);
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector2d a(600 * part(random), 720 * part(random));
      const Eigen::Vector2d b(1280 - 600 * part(random), 720 * part(random));
      if ((a - b).norm() < 200) continue;
      const auto pose = internal::two_point_pose(exact_match(picture, a), exact_match(picture, b),
                                                 picture.knowledge(true));
      ASSERT_TRUE(pose);
      // Half a field a second turns the image by 7 px between first and last row; a turn rate that is constant instead of the
      // angles' leaves of it, see map_projection.h, less than 0.02 px.
      EXPECT_NEAR(pose->log_f, std::log(f), 1e-4);
      EXPECT_LT(f * (pose->R_base_from_camera - picture.base_from_camera(0)).norm(), 0.15);
    }
  }
}

TEST(TwoPointPose, RefusesWhatDetermineNothing) {
  const SeenPicture picture = lively_picture(1200, 0.3, 0.2, 0);
  const PoseKnowledge knowledge = picture.knowledge(false);
  const PoseMatch a = exact_match(picture, {200, 300});
  const PoseMatch b = exact_match(picture, {900, 500});
  ASSERT_TRUE(internal::two_point_pose(a, b, knowledge));
  EXPECT_FALSE(internal::two_point_pose(a, a, knowledge));
  EXPECT_FALSE(internal::two_point_pose(a, exact_match(picture, {201, 301}), knowledge));
  PoseMatch same_direction = b;
  same_direction.d_b = a.d_b;
  EXPECT_FALSE(internal::two_point_pose(a, same_direction, knowledge));
  PoseMatch same_pixel = b;
  same_pixel.u = a.u;
  EXPECT_FALSE(internal::two_point_pose(a, same_pixel, knowledge));
  PoseMatch opposite = b;
  opposite.d_b = -a.d_b;
  EXPECT_FALSE(internal::two_point_pose(a, opposite, knowledge));
  // f would be far outside the range.
  PoseKnowledge narrow = knowledge;
  narrow.least_log_f = std::log(2000.0);
  EXPECT_FALSE(internal::two_point_pose(a, b, narrow));
  narrow = knowledge;
  narrow.most_log_f = std::log(1000.0);
  EXPECT_FALSE(internal::two_point_pose(a, b, narrow));
}

}  // namespace
}  // namespace alidade::test
