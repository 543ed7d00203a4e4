// The whole model in float, as a small board may run it. This program is compiled like the
// real-time path, without exceptions and run-time type information.

#include <gtest/gtest.h>

#include <limits>

#include "core/model/rolling_shutter.h"
#include "test/support/hard_values.h"

#if defined(__cpp_exceptions) || defined(__cpp_rtti)
#error "compile this file with -fno-exceptions -fno-rtti"
#endif

namespace alidade {
namespace {

constexpr double kEpsilon = std::numeric_limits<float>::epsilon();

template <int kRows, int kColumns>
double distance(const Matrix<float, kRows, kColumns>& a, const Matrix<double, kRows, kColumns>& b) {
  return (a.template cast<double>() - b).norm();
}

TEST(Float, RotationsAgreeWithDouble) {
  int checked = 0;
  for (const double angle : test::hard_angles()) {
    for (const Vector3<double>& axis : test::hard_directions()) {
      const Vector3<float> w = (angle * axis).cast<float>();
      const Vector3<double> exact = w.cast<double>();
      EXPECT_LE(distance(exp_so3(w), exp_so3(exact)), 16 * kEpsilon);
      EXPECT_LE(distance(left_jacobian_so3(w), left_jacobian_so3(exact)), 16 * kEpsilon);
      EXPECT_LE(distance(right_jacobian_so3(w), right_jacobian_so3(exact)), 16 * kEpsilon);
      // Near the singularity at a whole turn, at 6 rad, cot(3) magnifies the rounding of 3 fifty
      // times, and the square of [w] that of the quotient 36 times.
      EXPECT_LE(distance(left_jacobian_inverse_so3(w), left_jacobian_inverse_so3(exact)),
                1000 * kEpsilon);
      EXPECT_LE(distance(right_jacobian_inverse_so3(w), right_jacobian_inverse_so3(exact)),
                1000 * kEpsilon);
      EXPECT_LE((exp_so3(log_so3(exp_so3(w))) - exp_so3(w)).norm(), 32 * kEpsilon);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 17 * 18);
}

TEST(Float, DirectionsReturnFromTheirDifferences) {
  int checked = 0;
  for (const Vector3<double>& from_exact : test::hard_directions()) {
    for (const Vector3<double>& to_exact : test::hard_directions()) {
      const Vector3<float> from = from_exact.cast<float>();
      const Vector3<float> to = to_exact.cast<float>();
      EXPECT_LE((direction_plus(from, direction_minus(to, from)) - to).norm(), 32 * kEpsilon)
          << from.transpose() << " to " << to.transpose();
      ++checked;
    }
  }
  EXPECT_EQ(checked, 18 * 18);
}

TEST(Float, CameraInvertsItself) {
  for (const auto& named : test::hard_cameras()) {
    const Camera<float> camera = named.camera.cast<float>();
    int checked = 0;
    for (const Vector2<double>& exact : test::pixel_grid(named, 31)) {
      const Vector2<float> u = exact.cast<float>();
      Vector3<float> d(0, 0, 0);
      Vector2<float> again(0, 0);
      ASSERT_EQ(unproject(camera, u, &d), ProjectionStatus::kOk) << named.name;
      ASSERT_EQ(project(camera, d, &again), ProjectionStatus::kOk) << named.name;
      EXPECT_LE((again - u).norm(), 16 * kEpsilon * (camera.width + exact.norm())) << named.name;
      ++checked;
    }
    EXPECT_EQ(checked, 31 * 31) << named.name;
  }
}

TEST(Float, RollingShutterAgreesWithDoubleWithJacobians) {
  int checked = 0;
  for (const auto& named : test::hard_cameras()) {
    const Camera<double>& camera = named.camera;
    const double pixel = 1 / camera.focal_length;
    for (const Mechanics<double>& mechanics : test::hard_mechanics()) {
      for (const double line_delay : test::hard_line_delays()) {
        const FrameMotion<double> motion{{0.4, -0.2}, {0.2, -0.1}, 540};
        for (const Vector2<double>& u : test::pixel_grid(named, 5)) {
          Vector3<double> d;
          Matrix<double, 3, 2> J_d_u;
          Matrix<double, 3, 4> J_d_motion;
          Matrix<double, 3, kParameterCount> J_d_parameters;
          ASSERT_EQ(rolling_shutter_unproject(camera, mechanics, line_delay, motion, u, &d, &J_d_u,
                                              &J_d_motion, &J_d_parameters),
                    ProjectionStatus::kOk);
          Vector3<float> d_f(0, 0, 0);
          Matrix<float, 3, 2> J_d_u_f;
          Matrix<float, 3, 4> J_d_motion_f;
          Matrix<float, 3, kParameterCount> J_d_parameters_f;
          ASSERT_EQ(rolling_shutter_unproject(camera.cast<float>(), mechanics.cast<float>(),
                                              static_cast<float>(line_delay), motion.cast<float>(),
                                              u.cast<float>(), &d_f, &J_d_u_f, &J_d_motion_f,
                                              &J_d_parameters_f),
                    ProjectionStatus::kOk);
          EXPECT_LE(distance(d_f, d), 16 * kEpsilon);
          EXPECT_LE(distance(J_d_u_f, J_d_u), 64 * kEpsilon * pixel);
          EXPECT_LE(distance(J_d_motion_f, J_d_motion), 32 * kEpsilon);
          for (int i = 0; i < kParameterCount; ++i) {
            const Vector3<float> column = J_d_parameters_f.col(i);
            const Vector3<double> expected = J_d_parameters.col(i);
            EXPECT_LE(distance(column, expected), 64 * kEpsilon * (1 + expected.norm()))
                << to_string(static_cast<Parameter>(i));
          }

          Vector2<float> u_f(0, 0);
          ASSERT_EQ(rolling_shutter_project(camera.cast<float>(), mechanics.cast<float>(),
                                            static_cast<float>(line_delay), motion.cast<float>(),
                                            d.cast<float>(), &u_f),
                    ProjectionStatus::kOk);
          // A few roundings of the direction, in pixels: hundredths at f = 32008 px.
          EXPECT_LE(distance(u_f, u), 16 * kEpsilon * (camera.focal_length + camera.width));
          ++checked;
        }
      }
    }
  }
  EXPECT_EQ(checked, 9 * 3 * 4 * 25);
}

}  // namespace
}  // namespace alidade
