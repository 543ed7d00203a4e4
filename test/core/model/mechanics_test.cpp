#include "core/model/mechanics.h"

#include <gtest/gtest.h>

#include "test/core/model/rounding.h"
#include "test/support/hard_values.h"
#include "test/support/numeric_jacobian.h"

namespace alidade {
namespace {

using test::hard_angles;
using test::hard_mechanics;
using test::numeric_jacobian;

using Vec2 = Vector2<double>;
using Vec3 = Vector3<double>;
using Mat3 = Matrix3<double>;
using Vec4 = Vector4<double>;

using test::kEpsilon;

std::vector<PanTilt<double>> hard_pan_tilts() {
  std::vector<PanTilt<double>> angles;
  for (const double angle : hard_angles()) {
    angles.push_back({angle, 0.3});
    angles.push_back({-angle, -0.8});
    angles.push_back({0.4, angle});
    angles.push_back({-2, -angle});
  }
  return angles;
}

// The mount with its axes moved by (+) in their own bases.
Mechanics<double> with_axes(const Mechanics<double>& mechanics, const Vec4& change) {
  Mechanics<double> changed = mechanics;
  changed.pan_axis = direction_plus<double>(mechanics.pan_axis, change.head<2>());
  changed.tilt_axis = direction_plus<double>(mechanics.tilt_axis, change.tail<2>());
  return changed;
}

TEST(Mechanics, CameraIsAlignedWithTheBaseAtZero) {
  for (const auto& mechanics : hard_mechanics()) {
    const Mat3 R = R_base_from_camera(mechanics, {0, 0});
    EXPECT_EQ(R * Vec3::UnitX(), Vec3::UnitY()) << "right is right";
    EXPECT_EQ(R * Vec3::UnitY(), Vec3::UnitZ()) << "down is down";
    EXPECT_EQ(R * Vec3::UnitZ(), Vec3::UnitX()) << "forward is forward";
  }
}

TEST(Mechanics, PositivePanLooksRightAndPositiveTiltLooksUp) {
  const Mechanics<double> nominal;
  const Vec3 forward = Vec3::UnitZ();
  EXPECT_LE((R_base_from_camera(nominal, {kPi / 2, 0}) * forward - Vec3(0, 1, 0)).norm(), kEpsilon);
  EXPECT_LE((R_base_from_camera(nominal, {0, kPi / 2}) * forward - Vec3(0, 0, -1)).norm(),
            kEpsilon);
  // Tilted up 30 degrees, then panned right 90: the tilt axis pans along.
  EXPECT_LE(
      (R_base_from_camera(nominal, {kPi / 2, kPi / 6}) * forward - Vec3(0, std::sqrt(0.75), -0.5))
          .norm(),
      2 * kEpsilon);
}

TEST(Mechanics, OrientationIsTheProductOfExponentials) {
  int checked = 0;
  for (const auto& mechanics : hard_mechanics()) {
    for (const auto& p : hard_pan_tilts()) {
      const Mat3 expected = exp_so3<double>(p.pan * mechanics.pan_axis) *
                            exp_so3<double>(p.tilt * mechanics.tilt_axis) *
                            r_frd_from_rdf<double>();
      EXPECT_LE((R_base_from_camera(mechanics, p) - expected).norm(), 32 * kEpsilon);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 3 * 68);
}

TEST(Mechanics, WholeTurnsDoNotMatter) {
  for (const auto& mechanics : hard_mechanics()) {
    for (const auto& p : hard_pan_tilts()) {
      Matrix<double, 3, 4> J;
      Matrix<double, 3, 4> J_wrapped;
      const Mat3 R = R_base_from_camera(mechanics, p, nullptr, &J);
      const Mat3 wrapped = R_base_from_camera(mechanics, plus<double>(p, Vec2(2 * kPi, -2 * kPi)),
                                              nullptr, &J_wrapped);
      EXPECT_LE((R - wrapped).norm(), 64 * kEpsilon);
      EXPECT_LE((J - J_wrapped).norm(), 64 * kEpsilon);
    }
  }
}

TEST(Mechanics, JacobiansOfTheOrientationAgreeWithNumericOnes) {
  int checked = 0;
  int evaluated = 0;
  for (const auto& mechanics : hard_mechanics()) {
    for (const auto& p : hard_pan_tilts()) {
      Matrix<double, 3, 2> J_angle;
      Matrix<double, 3, 4> J_axes;
      const Mat3 R = R_base_from_camera(mechanics, p, &J_angle, &J_axes);
      const auto numeric_angle = numeric_jacobian<3, 2>(
          [&](const Vec2& e) -> std::optional<Vec3> {
            return log_so3<double>(R.transpose() *
                                   R_base_from_camera(mechanics, {p.pan + e[0], p.tilt + e[1]}));
          },
          1e-3);
      const auto numeric_axes = numeric_jacobian<3, 4>(
          [&](const Vec4& e) -> std::optional<Vec3> {
            return log_so3<double>(R.transpose() * R_base_from_camera(with_axes(mechanics, e), p));
          },
          1e-3);
      EXPECT_LE((J_angle - numeric_angle.J).norm(), 1e-10) << p.pan << " " << p.tilt;
      EXPECT_LE((J_axes - numeric_axes.J).norm(), 1e-10) << p.pan << " " << p.tilt;
      evaluated += numeric_angle.evaluated + numeric_axes.evaluated;
      ++checked;
    }
  }
  EXPECT_EQ(checked, 3 * 68);
  EXPECT_EQ(evaluated, checked * 24);
}

TEST(Mechanics, AngularVelocityIsTheOrientationsDerivative) {
  int checked = 0;
  const PanTilt<double> rate{0.7, -0.4};
  for (const auto& mechanics : hard_mechanics()) {
    for (const auto& p : hard_pan_tilts()) {
      const Mat3 R = R_base_from_camera(mechanics, p);
      const auto numeric = numeric_jacobian<3, 1>(
          [&](const Matrix<double, 1, 1>& t) -> std::optional<Vec3> {
            return log_so3<double>(R.transpose() *
                                   R_base_from_camera(mechanics, {p.pan + rate.pan * t[0],
                                                                  p.tilt + rate.tilt * t[0]}));
          },
          1e-3);
      ASSERT_EQ(numeric.evaluated, 4);
      EXPECT_LE((angular_velocity(mechanics, p, rate) - numeric.J).norm(), 1e-11);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 3 * 68);
}

TEST(Mechanics, JacobiansOfTheAngularVelocityAgreeWithNumericOnes) {
  int evaluated = 0;
  int checked = 0;
  const PanTilt<double> rate{0.7, -0.4};
  for (const auto& mechanics : hard_mechanics()) {
    for (const auto& p : hard_pan_tilts()) {
      Matrix<double, 3, 2> J_angle;
      Matrix<double, 3, 2> J_rate;
      Matrix<double, 3, 4> J_axes;
      (void)angular_velocity(mechanics, p, rate, &J_angle, &J_rate, &J_axes);
      const auto numeric_angle = numeric_jacobian<3, 2>(
          [&](const Vec2& e) -> std::optional<Vec3> {
            return angular_velocity(mechanics, {p.pan + e[0], p.tilt + e[1]}, rate);
          },
          1e-3);
      const auto numeric_rate = numeric_jacobian<3, 2>(
          [&](const Vec2& e) -> std::optional<Vec3> {
            return angular_velocity(mechanics, p, {rate.pan + e[0], rate.tilt + e[1]});
          },
          1e-3);
      const auto numeric_axes = numeric_jacobian<3, 4>(
          [&](const Vec4& e) -> std::optional<Vec3> {
            return angular_velocity(with_axes(mechanics, e), p, rate);
          },
          1e-3);
      EXPECT_LE((J_angle - numeric_angle.J).norm(), 1e-10);
      EXPECT_LE((J_rate - numeric_rate.J).norm(), 1e-10);
      EXPECT_LE((J_axes - numeric_axes.J).norm(), 1e-10);
      evaluated += numeric_angle.evaluated + numeric_rate.evaluated + numeric_axes.evaluated;
      ++checked;
    }
  }
  EXPECT_EQ(checked, 3 * 68);
  EXPECT_EQ(evaluated, checked * 32);
}

TEST(Mechanics, MeasuredAngleIsTheScaledTrueOne) {
  Mechanics<double> mechanics;
  mechanics.pan_scale = 1.02;
  mechanics.tilt_scale = 0.97;
  const PanTilt<double> measured = measured_from_true<double>(mechanics, {2, -0.5});
  EXPECT_DOUBLE_EQ(measured.pan, 2.04);
  EXPECT_DOUBLE_EQ(measured.tilt, -0.485);
  const PanTilt<double> again = true_from_measured(mechanics, measured);
  EXPECT_DOUBLE_EQ(again.pan, 2);
  EXPECT_DOUBLE_EQ(again.tilt, -0.5);
}

}  // namespace
}  // namespace alidade
