#include "core/mapping/map_projection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "test/core/mapping/seen_picture.h"
#include "test/support/numeric_jacobian.h"

namespace alidade::test {
namespace {

std::vector<SeenPicture> pictures() {
  std::vector<SeenPicture> out;
  for (const double f : {1200.0, 5000.0, 24000.0}) {
    for (const double fields : {0.0, 0.2, 1.0}) {
      out.push_back(lively_picture(f, kPi - 1e-3, 0.3, fields));
      out.push_back(lively_picture(f, -1.2, -1.4, -fields));
    }
  }
  return out;
}

Camera<double> camera_of(const SeenPicture& picture) {
  return picture.knowledge(true).lens.camera_of(std::log(picture.focal_length));
}

TEST(MapProjection, AgreesWithAPictureThatWasSimulated) {
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> part(0, 1);
  for (const SeenPicture& picture : pictures()) {
    const PictureMotion motion = picture.knowledge(true).motion;
    const Matrix3<double> R = picture.base_from_camera(0);
    // Angles' rates are constant in the one, the camera's turn rate in the other: the turn rate changes by the product of both
    // rates, and the image by half that and the square of half a read-out.
    const double half_readout = 360 * std::abs(picture.line_delay);
    const double allowed = 1e-6 + 2 * picture.focal_length *
                                      std::abs(picture.pan_rate * picture.tilt_rate) *
                                      half_readout * half_readout / 2;
    ASSERT_LT(allowed, 0.2);
    for (int i = 0; i < 50; ++i) {
      const Eigen::Vector2d u(1280 * part(random), 720 * part(random));
      const Eigen::Vector3d d = picture.direction_of(u);
      MapProjection out;
      ASSERT_EQ(project_from_map(camera_of(picture), motion, R, u.y(), d, &out),
                ProjectionStatus::kOk);
      EXPECT_LT((out.u - u).norm(), allowed);
      Vector3<double> back;
      ASSERT_EQ(unproject_to_map(camera_of(picture), motion, R, u, &back), ProjectionStatus::kOk);
      EXPECT_LT(picture.focal_length * (back - d).norm(), 1.2 * allowed);
    }
  }
}

TEST(MapProjection, ItsJacobiansAreTheNumericOnes) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> part(0, 1);
  int evaluated = 0;
  for (const SeenPicture& picture : pictures()) {
    const PictureMotion motion = picture.knowledge(true).motion;
    const Matrix3<double> R = picture.base_from_camera(0);
    const Camera<double> camera = camera_of(picture);
    const double f = picture.focal_length;
    const double noise = 1e-14 * f + 1e-12;  // of a pixel, px
    const auto seen = [&](const Camera<double>& with, const Matrix3<double>& turned, double row,
                          const Vector3<double>& d) -> std::optional<Vector2<double>> {
      MapProjection out;
      if (project_from_map(with, motion, turned, row, d, &out) != ProjectionStatus::kOk)
        return std::nullopt;
      return out.u;
    };
    for (int i = 0; i < 10; ++i) {
      const Eigen::Vector2d u(1280 * part(random), 720 * part(random));
      const Vector3<double> d = picture.direction_of(u);
      MapProjection at;
      ASSERT_EQ(project_from_map(camera, motion, R, u.y(), d, &at), ProjectionStatus::kOk);
      const auto by_xi = numeric_jacobian<2, 3>(
          [&](const Vector3<double>& xi) { return seen(camera, R * exp_so3(xi), u.y(), d); },
          1.0 / f);
      const auto by_d = numeric_jacobian<2, 3>(
          [&](const Vector3<double>& off) { return seen(camera, R, u.y(), d + off); }, 1.0 / f);
      const auto by_row = numeric_jacobian<2, 1>(
          [&](const Matrix<double, 1, 1>& rows) { return seen(camera, R, u.y() + rows[0], d); },
          1.0);
      const auto by_motion = numeric_jacobian<2, 4>(
          [&](const Vector4<double>& off) -> std::optional<Vector2<double>> {
            PictureMotion other = motion;
            other.angular_velocity += off.head<3>();
            other.zoom_rate += off[3];
            Vector2<double> u_of;
            if (pixel_from_map(camera, other, R, u.y(), d, &u_of) != ProjectionStatus::kOk) {
              return std::nullopt;
            }
            return u_of;
          },
          Vector4<double>(100 / f, 100 / f, 0.1, 0.1));
      const double per_corner = std::pow(f / 734, 2);
      const auto by_camera = numeric_jacobian<2, 5>(
          [&](const Matrix<double, 5, 1>& off) {
            Camera<double> with = camera;
            with.focal_length += off[0];
            with.aspect += off[1];
            with.distortion.radial += off[2];
            with.centre_u += off[3];
            with.centre_v += off[4];
            return seen(with, R, u.y(), d);
          },
          Matrix<double, 5, 1>(1e-3 * f, 1e-3, 1e-3 * per_corner, 1, 1));
      evaluated += by_xi.evaluated + by_d.evaluated + by_row.evaluated + by_camera.evaluated +
                   by_motion.evaluated;
      EXPECT_LT((disagreement<2, 3>(at.J_u_xi, by_xi, noise)), 1);
      EXPECT_LT((disagreement<2, 3>(at.J_u_d, by_d, noise)), 1);
      EXPECT_LT((disagreement<2, 1>(at.J_u_row, by_row, noise)), 1);
      EXPECT_LT((disagreement<2, 5>(at.J_u_camera, by_camera, noise)), 1);
      EXPECT_LT((disagreement<2, 4>(at.J_u_motion, by_motion, noise)), 1);
    }
  }
  EXPECT_EQ(evaluated, static_cast<int>(pictures().size()) * 10 * 4 * 16);
}

TEST(MapProjection, WhatIsBehindTheCameraIsNotSeen) {
  const SeenPicture picture = lively_picture(1200, 0, 0, 0.1);
  const Matrix3<double> R = picture.base_from_camera(0);
  MapProjection out;
  EXPECT_EQ(
      project_from_map(camera_of(picture), picture.knowledge(true).motion, R, 360, -R.col(2), &out),
      ProjectionStatus::kBehindCamera);
}

}  // namespace
}  // namespace alidade::test
