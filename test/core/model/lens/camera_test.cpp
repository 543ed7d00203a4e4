#include "core/model/lens/camera.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "test/core/model/rounding.h"
#include "test/support/hard_values.h"
#include "test/support/not_a_number.h"
#include "test/support/numeric_jacobian.h"

namespace alidade {
namespace {

using test::hard_cameras;
using test::numeric_jacobian;
using test::pixel_grid;

using Vec2 = Vector2<double>;
using Vec3 = Vector3<double>;

using test::kEpsilon;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Camera, ProjectsByItsDefinition) {
  const Camera<double> camera{1000, 1.1, {0.5}, 640, 480};
  Vec2 u;
  ASSERT_EQ(project(camera, Vec3(0.2, -0.4, 2), &u), ProjectionStatus::kOk);
  const double s = 1 + 0.5 * (0.01 + 0.04);
  EXPECT_NEAR(u.x(), 320 + 1000 * 0.1 * s, 1e-12);
  EXPECT_NEAR(u.y(), 240 - 1100 * 0.2 * s, 1e-12);
}

TEST(Camera, OpticalAxisProjectsToTheOpticalCentre) {
  for (const auto& [name, camera, margin] : hard_cameras()) {
    Vec2 u;
    ASSERT_EQ(project(camera, Vec3(0, 0, 1), &u), ProjectionStatus::kOk) << name;
    EXPECT_EQ(u, Vec2(camera.width / 2.0 + camera.centre_u, camera.height / 2.0 + camera.centre_v))
        << name;
    Vec3 d;
    ASSERT_EQ(unproject(camera, u, &d), ProjectionStatus::kOk) << name;
    EXPECT_EQ(d, Vec3(0, 0, 1)) << name;
  }
}

TEST(Camera, UndistortionRatioKeepsFullRelativeAccuracy) {
  // Above 1e8, far from any lens, the rounding of asinh(y), which sinh magnifies, begins to show.
  int checked = 0;
  for (double exponent = -300; exponent <= 8; exponent += 0.25) {
    const double magnitude = std::pow(10, exponent);
    for (const double q : {magnitude, -magnitude}) {
      if (q < -0.148) continue;
      const long double m = internal::undistortion_ratio(q);
      // The remaining error of m in m + q m^3 = 1, found in higher precision, to first order.
      const long double error = (m + q * m * m * m - 1) / (1 + 3 * q * m * m);
      const double conditioning = std::max(1.0, static_cast<double>(m / (1 + 3 * q * m * m)));
      EXPECT_LE(std::abs(error / m), 4 * kEpsilon * conditioning) << "q " << q;
      ++checked;
    }
  }
  EXPECT_EQ(checked, 1233 + 1197);
}

TEST(Camera, UndistortionRatioIsSmoothWhereTheSeriesEnds) {
  for (const double sign : {1.0, -1.0}) {
    const double inside = internal::undistortion_ratio(sign * std::nextafter(1e-3, 0));
    const double outside = internal::undistortion_ratio(sign * 1e-3);
    EXPECT_NEAR(inside, outside, 4 * kEpsilon);
  }
}

TEST(Camera, ProjectInvertsUnprojectOverTheImageAndBeyond) {
  for (const auto& named : hard_cameras()) {
    const auto& [name, camera, margin] = named;
    int checked = 0;
    for (const Vec2& u : pixel_grid(named, 101)) {
      Vec3 d;
      ASSERT_EQ(unproject(camera, u, &d), ProjectionStatus::kOk) << name << " " << u.transpose();
      EXPECT_NEAR(d.norm(), 1, 4 * kEpsilon) << name;
      Vec2 again;
      ASSERT_EQ(project(camera, d, &again), ProjectionStatus::kOk) << name;
      // A few roundings of numbers of the size of the coordinates.
      EXPECT_LE((again - u).norm(), 16 * kEpsilon * (camera.width + u.norm())) << name;
      ++checked;
    }
    EXPECT_EQ(checked, 101 * 101) << name;
  }
}

TEST(Camera, UnprojectInvertsProjectAndDoesNotNeedUnitLength) {
  for (const auto& named : hard_cameras()) {
    const auto& [name, camera, margin] = named;
    int checked = 0;
    for (const Vec2& u : pixel_grid(named, 31)) {
      // An undistorted guess gives directions that are not those of the other test.
      const Vec3 d = Vec3((u.x() - camera.width / 2.0) / camera.focal_length,
                          (u.y() - camera.height / 2.0) / camera.focal_length, 1)
                         .normalized();
      Vec2 projected;
      ASSERT_EQ(project(camera, 7 * d, &projected), ProjectionStatus::kOk) << name;
      Vec3 again;
      ASSERT_EQ(unproject(camera, projected, &again), ProjectionStatus::kOk) << name;
      // The pixel's rounding, magnified up to 40 times near the barrel's limit.
      EXPECT_LE((again - d).norm(), 40 * kEpsilon * (1 + camera.width / camera.focal_length))
          << name;
      ++checked;
    }
    EXPECT_EQ(checked, 31 * 31) << name;
  }
}

using CameraChange = Matrix<double, kCameraParameterCount, 1>;

Camera<double> changed(Camera<double> camera, const CameraChange& e) {
  camera.focal_length += e[0];
  camera.aspect += e[1];
  camera.distortion.radial += e[2];
  camera.centre_u += e[3];
  camera.centre_v += e[4];
  return camera;
}

CameraChange camera_steps(double k_step) {
  CameraChange steps;
  steps << 1, 1e-3, k_step, 1, 1;
  return steps;
}

TEST(Camera, OpticalCentreShiftsAllPixelsAlike) {
  for (const auto& named : hard_cameras()) {
    Camera<double> shifted = named.camera;
    shifted.centre_u += 17.25;
    shifted.centre_v -= 3.5;
    int checked = 0;
    for (const Vec2& u : pixel_grid(named, 9)) {
      Vec3 d;
      ASSERT_EQ(unproject(named.camera, u, &d), ProjectionStatus::kOk);
      Vec2 there;
      ASSERT_EQ(project(shifted, d, &there), ProjectionStatus::kOk);
      EXPECT_LE((there - u - Vec2(17.25, -3.5)).norm(), 1e-9) << named.name;
      ++checked;
    }
    EXPECT_EQ(checked, 81) << named.name;
  }
}

TEST(Camera, JacobiansOfProjectAgreeWithNumericOnes) {
  for (const auto& named : hard_cameras()) {
    const Camera<double>& camera = named.camera;
    int checked = 0;
    int evaluated = 0;
    for (const Vec2& u : pixel_grid(named, 9)) {
      Vec3 d;
      ASSERT_EQ(unproject(camera, u, &d), ProjectionStatus::kOk);
      d *= 1.7;
      Vec2 projected;
      Matrix<double, 2, 3> J_u_d;
      Matrix<double, 2, kCameraParameterCount> J_u_camera;
      ASSERT_EQ(project(camera, d, &projected, &J_u_d, &J_u_camera), ProjectionStatus::kOk);
      const auto at = [](const Camera<double>& c, const Vec3& direction) -> std::optional<Vec2> {
        Vec2 result;
        if (project(c, direction, &result) != ProjectionStatus::kOk) return std::nullopt;
        return result;
      };
      // A step of one pixel.
      const auto numeric_d = numeric_jacobian<2, 3>(
          [&](const Vec3& e) { return at(camera, d + e); }, 1 / camera.focal_length);
      const double k_step = 1e-3 * std::max(1.0, std::abs(camera.distortion.radial));
      const auto numeric_camera = numeric_jacobian<2, kCameraParameterCount>(
          [&](const CameraChange& e) { return at(changed(camera, e), d); }, camera_steps(k_step));
      // A few roundings of coordinates of thousands of pixels.
      EXPECT_LT(test::disagreement(J_u_d, numeric_d, 4e-12), 1) << named.name;
      EXPECT_LT(test::disagreement(J_u_camera, numeric_camera, 4e-12), 1) << named.name;
      evaluated += numeric_d.evaluated + numeric_camera.evaluated;
      ++checked;
    }
    EXPECT_EQ(checked, 81) << named.name;
    EXPECT_EQ(evaluated, 81 * 32) << named.name;
  }
}

TEST(Camera, JacobiansOfUnprojectAgreeWithNumericOnes) {
  for (const auto& named : hard_cameras()) {
    const Camera<double>& camera = named.camera;
    int checked = 0;
    int evaluated = 0;
    for (const Vec2& u : pixel_grid(named, 9)) {
      Vec3 d;
      Matrix<double, 3, 2> J_d_u;
      Matrix<double, 3, kCameraParameterCount> J_d_camera;
      ASSERT_EQ(unproject(camera, u, &d, &J_d_u, &J_d_camera), ProjectionStatus::kOk);
      const auto at = [](const Camera<double>& c, const Vec2& pixel) -> std::optional<Vec3> {
        Vec3 result;
        if (unproject(c, pixel, &result) != ProjectionStatus::kOk) return std::nullopt;
        return result;
      };
      const auto numeric_u =
          numeric_jacobian<3, 2>([&](const Vec2& e) { return at(camera, u + e); }, 1.0);
      const double k_step = 1e-3 * std::max(1.0, std::abs(camera.distortion.radial));
      const auto numeric_camera = numeric_jacobian<3, kCameraParameterCount>(
          [&](const CameraChange& e) { return at(changed(camera, e), u); }, camera_steps(k_step));
      EXPECT_LT(test::disagreement(J_d_u, numeric_u, 1e-15), 1) << named.name;
      EXPECT_LT(test::disagreement(J_d_camera, numeric_camera, 1e-15), 1) << named.name;
      evaluated += numeric_u.evaluated + numeric_camera.evaluated;
      ++checked;
    }
    EXPECT_EQ(checked, 81) << named.name;
    EXPECT_EQ(evaluated, 81 * 28) << named.name;
  }
}

TEST(Camera, RefusesDirectionsThatAreNotInFront) {
  for (const auto& [name, camera, margin] : hard_cameras()) {
    Vec2 u(-1, -2);
    for (const Vec3& d : {Vec3(0, 0, -1), Vec3(1, 0, 0), Vec3(0.1, 0.2, -1e-300), Vec3(0, 0, 0)}) {
      EXPECT_EQ(project(camera, d, &u), ProjectionStatus::kBehindCamera) << name;
    }
    EXPECT_EQ(u, Vec2(-1, -2)) << "a refusal writes nothing";
  }
}

TEST(Camera, RefusesWhatLiesBeyondTheBarrelsLimit) {
  const Camera<double> camera{900, 1, {-0.2}, 1280, 720};
  // The model turns back at |x| = 1 / sqrt(3 |k|), in the image at two thirds of that times f.
  const double r_limit = 1 / std::sqrt(0.6);
  const double pixel_limit = 900 * r_limit * 2 / 3;
  int checked = 0;
  for (double heading = 0; heading < 6.28; heading += 0.1) {
    const Vec2 away(std::cos(heading), std::sin(heading));
    const auto direction = [&](double r) { return Vec3(r * away.x(), r * away.y(), 1); };
    const auto pixel = [&](double r) -> Vec2 { return Vec2(640, 360) + r * away; };
    Vec2 u;
    Vec3 d(7, 8, 9);
    EXPECT_EQ(project(camera, direction(r_limit * (1 - 1e-9)), &u), ProjectionStatus::kOk);
    EXPECT_LE((u - pixel(pixel_limit)).norm(), 1e-6);
    for (const double factor : {1 + 1e-9, 1.5, 100.0}) {
      EXPECT_EQ(project(camera, direction(r_limit * factor), &u),
                ProjectionStatus::kBeyondDistortionLimit);
      EXPECT_EQ(unproject(camera, pixel(pixel_limit * factor), &d),
                ProjectionStatus::kBeyondDistortionLimit);
    }
    EXPECT_EQ(d, Vec3(7, 8, 9)) << "a refusal writes nothing";
    ASSERT_EQ(unproject(camera, pixel(pixel_limit * (1 - 1e-9)), &d), ProjectionStatus::kOk);
    // Distance 1e-9 from the limit in the image is the square root of that in direction.
    EXPECT_LE((d - direction(r_limit).normalized()).norm(), 1e-4);
    ++checked;
  }
  EXPECT_EQ(checked, 63);
}

TEST(Camera, RefusesWhatIsNotFinite) {
  for (const auto& [name, camera, margin] : hard_cameras()) {
    Vec2 u;
    Vec3 d;
    for (const double bad : {kNan, kInfinity, -kInfinity}) {
      for (int i = 0; i < 3; ++i) {
        Vec3 direction(0, 0, 1);
        direction[i] = bad;
        EXPECT_EQ(project(camera, direction, &u), ProjectionStatus::kNotFinite) << name;
      }
      for (int i = 0; i < 2; ++i) {
        Vec2 pixel(10, 20);
        pixel[i] = bad;
        EXPECT_EQ(unproject(camera, pixel, &d), ProjectionStatus::kNotFinite) << name;
      }
    }
  }
}

TEST(Camera, NeverGivesAnythingButFiniteNumbersWithOk) {
  const std::vector<double> nasty = {0,     -0.0, 1e-320,    -1e-320,   1e-160, 1,
                                     -1,    1e5,  -1e20,     1e80,      1e160,  -1e160,
                                     1e308, kNan, kInfinity, -kInfinity};
  int asked = 0;
  int ok = 0;
  for (const double f : nasty) {
    for (const double k : nasty) {
      const Camera<double> camera{f, 1, {k}, 1280, 720};
      for (const double a : nasty) {
        for (const double b : nasty) {
          Vec3 d;
          Matrix<double, 3, 2> J_d_u;
          if (unproject(camera, Vec2(a, b), &d) == ProjectionStatus::kOk) {
            EXPECT_TRUE(d.allFinite()) << f << " " << k << " " << a << " " << b;
            EXPECT_NEAR(d.norm(), 1, 1e-12) << f << " " << k << " " << a << " " << b;
            ++ok;
          }
          Vec2 u;
          if (project(camera, Vec3(a, 0.5, b), &u) == ProjectionStatus::kOk) {
            EXPECT_TRUE(u.allFinite()) << f << " " << k << " " << a << " " << b;
            ++ok;
          }
          asked += 2;
        }
      }
    }
  }
  EXPECT_EQ(asked, 2 * 16 * 16 * 16 * 16);
  EXPECT_GT(ok, asked / 20);
}

TEST(Camera, EveryStatusHasItsOwnText) {
  EXPECT_STREQ(to_string(ProjectionStatus::kOk), "ok");
  EXPECT_STREQ(to_string(ProjectionStatus::kBehindCamera), "behind the camera");
  EXPECT_STRNE(to_string(ProjectionStatus::kNoRow), to_string(ProjectionStatus::kNotFinite));
}

}  // namespace
}  // namespace alidade
