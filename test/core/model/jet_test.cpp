// Every analytic Jacobian of the model beside the one that ceres::Jet derives from the same
// template: this also proves that the templates can serve as cost functions.

#include <ceres/jet.h>
#include <gtest/gtest.h>

#include "core/model/rolling_shutter.h"
#include "test/support/hard_values.h"

namespace alidade {
namespace {

using Vec2 = Vector2<double>;
using Vec3 = Vector3<double>;

template <int kSize>
using Jet = ceres::Jet<double, kSize>;

// value with its coefficients as independent variables first, first + 1, ...
template <int kSize, int kRows>
Matrix<Jet<kSize>, kRows, 1> variables(const Matrix<double, kRows, 1>& value, int first = 0) {
  Matrix<Jet<kSize>, kRows, 1> jets;
  for (int i = 0; i < kRows; ++i) jets[i] = Jet<kSize>(value[i], first + i);
  return jets;
}

template <int kSize, int kRows>
Matrix<double, kRows, 1> value_of(const Matrix<Jet<kSize>, kRows, 1>& jets) {
  Matrix<double, kRows, 1> value;
  for (int i = 0; i < kRows; ++i) value[i] = jets[i].a;
  return value;
}

template <int kSize, int kRows>
Matrix<double, kRows, kSize> derivative(const Matrix<Jet<kSize>, kRows, 1>& jets) {
  Matrix<double, kRows, kSize> J;
  for (int i = 0; i < kRows; ++i) J.row(i) = jets[i].v.transpose();
  return J;
}

// Column by column: |J - expected| <= tolerance (|expected| + scale), and no NaN.
template <int kRows, int kColumns>
void expect_columns_near(const Matrix<double, kRows, kColumns>& J,
                         const Matrix<double, kRows, kColumns>& expected, double tolerance,
                         double scale, const std::string& what) {
  for (int i = 0; i < kColumns; ++i) {
    EXPECT_LE((J.col(i) - expected.col(i)).norm(), tolerance * (expected.col(i).norm() + scale))
        << what << ", column " << i << "\n"
        << J << "\nexpected\n"
        << expected;
  }
}

TEST(Jet, ExpAndLogAreDifferentiableAtZeroAndAtHalfATurn) {
  int checked = 0;
  for (const double angle : test::hard_angles()) {
    for (const Vec3& axis : test::hard_directions()) {
      const Vec3 w = angle * axis;
      // d Log(Exp(w)^T Exp(w + e)) / de at e = 0 is the right Jacobian: Log at zero.
      const Matrix3<Jet<3>> R_transposed = exp_so3(w).transpose().template cast<Jet<3>>();
      const Matrix3<Jet<3>> R = exp_so3(variables<3>(w));
      expect_columns_near<3, 3>(derivative(log_so3<Jet<3>>(R_transposed * R)),
                                right_jacobian_so3(w), 1e-13, 1, "right Jacobian");
      // d Log(R Exp(e)) / de is its inverse: Log at w, which is off 0 and pi only for these.
      if (angle < kPi - 1e-12) {
        const Matrix3<Jet<3>> perturbed =
            exp_so3(w).template cast<Jet<3>>() * exp_so3(variables<3>(Vec3(0, 0, 0)));
        expect_columns_near<3, 3>(derivative(log_so3<Jet<3>>(perturbed)),
                                  right_jacobian_inverse_so3(w), 1e-12, 1, "its inverse");
      }
      ++checked;
    }
  }
  EXPECT_EQ(checked, 17 * 18);
}

TEST(Jet, DirectionJacobiansAreTheDerivatives) {
  int checked = 0;
  for (const Vec3& d : test::hard_directions()) {
    for (const double length : test::hard_angles()) {
      const Vec2 xi(0.6 * length, -0.8 * length);
      const Matrix<Jet<5>, 2, 1> xi_jet = variables<5>(xi);
      const Matrix<Jet<5>, 3, 1> d_jet = variables<5>(d, 2);
      Matrix<double, 3, 2> J_xi;
      Matrix3<double> J_d;
      const Vec3 to = direction_plus(d, xi, &J_xi, &J_d);
      const Matrix<double, 3, 5> plus_J = derivative(direction_plus(d_jet, xi_jet));
      // With respect to a direction, tangential changes only are meant.
      const Matrix<double, 3, 2> B = tangent_basis(d);
      expect_columns_near<3, 2>(J_xi, plus_J.leftCols<2>(), 1e-12, 1, "plus, xi");
      expect_columns_near<3, 2>(J_d * B, plus_J.rightCols<3>() * B, 1e-11, 1, "plus, d");
      ++checked;

      if (std::abs(length - kPi) < 1e-4 || length > 5) continue;
      Matrix<double, 2, 3> J_to;
      Matrix<double, 2, 3> J_from;
      (void)direction_minus(to, d, &J_to, &J_from);
      const Matrix<double, 2, 3> minus_J_to =
          derivative(direction_minus(variables<3>(to), Vector3<Jet<3>>(d.cast<Jet<3>>())));
      const Matrix<double, 2, 3> minus_J_from =
          derivative(direction_minus(Vector3<Jet<3>>(to.cast<Jet<3>>()), variables<3>(d)));
      const Matrix<double, 3, 2> B_to = tangent_basis(to);
      // At 3 rad, 0.14 from the antipode, the quotients have lost three digits.
      expect_columns_near<2, 2>(J_to * B_to, minus_J_to * B_to, 1e-10, 1, "minus, to");
      expect_columns_near<2, 2>(J_from * B, minus_J_from * B, 1e-10, 1, "minus, from");
      ++checked;
    }
  }
  EXPECT_EQ(checked, 18 * (17 + 10));
}

TEST(Jet, CameraJacobiansAreTheDerivatives) {
  for (const auto& named : test::hard_cameras()) {
    int checked = 0;
    const Camera<double>& camera = named.camera;
    for (const Vec2& u : test::pixel_grid(named, 21)) {
      Camera<Jet<8>> camera_jet = camera.cast<Jet<8>>();
      camera_jet.focal_length.v[3] = 1;
      camera_jet.aspect.v[4] = 1;
      camera_jet.distortion.radial.v[5] = 1;
      camera_jet.centre_u.v[6] = 1;
      camera_jet.centre_v.v[7] = 1;

      Vec3 d;
      Matrix<double, 3, 2> J_d_u;
      Matrix<double, 3, kCameraParameterCount> J_d_camera;
      ASSERT_EQ(unproject(camera, u, &d, &J_d_u, &J_d_camera), ProjectionStatus::kOk);
      Vector3<Jet<8>> d_jet;
      ASSERT_EQ(unproject(camera_jet, variables<8>(u), &d_jet), ProjectionStatus::kOk);
      EXPECT_LE((value_of(d_jet) - d).norm(), 1e-15);
      const Matrix<double, 3, 8> J_unproject = derivative(d_jet);
      const double pixel = 1 / camera.focal_length;
      expect_columns_near<3, 2>(J_d_u, J_unproject.leftCols<2>(), 1e-12, pixel, named.name);
      expect_columns_near<3, kCameraParameterCount>(
          J_d_camera, J_unproject.rightCols<kCameraParameterCount>(), 1e-11, pixel, named.name);

      Vec2 projected;
      Matrix<double, 2, 3> J_u_d;
      Matrix<double, 2, kCameraParameterCount> J_u_camera;
      ASSERT_EQ(project(camera, d, &projected, &J_u_d, &J_u_camera), ProjectionStatus::kOk);
      Vector2<Jet<8>> u_jet;
      ASSERT_EQ(project(camera_jet, variables<8>(d), &u_jet), ProjectionStatus::kOk);
      const Matrix<double, 2, 8> J_project = derivative(u_jet);
      expect_columns_near<2, 3>(J_u_d, J_project.leftCols<3>(), 1e-13, 1, named.name);
      expect_columns_near<2, kCameraParameterCount>(
          J_u_camera, J_project.rightCols<kCameraParameterCount>(), 1e-13, 1, named.name);
      ++checked;
    }
    EXPECT_EQ(checked, 441) << named.name;
  }
}

TEST(Jet, MechanicsJacobiansAreTheDerivatives) {
  int checked = 0;
  for (const Mechanics<double>& mechanics : test::hard_mechanics()) {
    for (const double pan : test::hard_angles()) {
      for (const double tilt : test::hard_angles()) {
        // pan, tilt, their rates, the axes in their tangent planes.
        using J8 = Jet<8>;
        const PanTilt<J8> angle{J8(pan, 0), J8(-tilt, 1)};
        const PanTilt<J8> rate{J8(0.7, 2), J8(-0.4, 3)};
        Mechanics<J8> jets = mechanics.cast<J8>();
        jets.pan_axis = direction_plus(jets.pan_axis, variables<8>(Vec2(0, 0), 4));
        jets.tilt_axis = direction_plus(jets.tilt_axis, variables<8>(Vec2(0, 0), 6));

        Matrix<double, 3, 2> J_xi_angle;
        Matrix<double, 3, 4> J_xi_axes;
        const Matrix3<double> R =
            R_base_from_camera(mechanics, {pan, -tilt}, &J_xi_angle, &J_xi_axes);
        const Matrix<double, 3, 8> J_xi =
            derivative(log_so3<J8>(R.transpose().cast<J8>() * R_base_from_camera(jets, angle)));
        expect_columns_near<3, 2>(J_xi_angle, J_xi.leftCols<2>(), 1e-14, 1, "angle");
        expect_columns_near<3, 4>(J_xi_axes, J_xi.rightCols<4>(), 1e-14, 1, "axes");

        Matrix<double, 3, 2> J_w_angle;
        Matrix<double, 3, 2> J_w_rate;
        Matrix<double, 3, 4> J_w_axes;
        (void)angular_velocity(mechanics, {pan, -tilt}, {0.7, -0.4}, &J_w_angle, &J_w_rate,
                               &J_w_axes);
        const Matrix<double, 3, 8> J_w = derivative(angular_velocity(jets, angle, rate));
        expect_columns_near<3, 2>(J_w_angle, J_w.leftCols<2>(), 1e-14, 1, "velocity, angle");
        expect_columns_near<3, 2>(J_w_rate, J_w.middleCols<2>(2), 1e-14, 1, "velocity, rate");
        expect_columns_near<3, 4>(J_w_axes, J_w.rightCols<4>(), 1e-14, 1, "velocity, axes");
        ++checked;
      }
    }
  }
  EXPECT_EQ(checked, 3 * 17 * 17);
}

// Variables: the pixel (2) or the tangent of the direction (2), the motion (4), the parameters.
constexpr int kVariables = 6 + kParameterCount;
using RollingJet = Jet<kVariables>;

struct RollingJets {
  Camera<RollingJet> camera;
  Mechanics<RollingJet> mechanics;
  RollingJet line_delay;
  FrameMotion<RollingJet> motion;
};

RollingJets rolling_jets(const Camera<double>& camera, const Mechanics<double>& mechanics,
                         double line_delay, const FrameMotion<double>& motion) {
  const auto slot = [](Parameter parameter) { return 6 + index(parameter); };
  RollingJets jets{camera.cast<RollingJet>(), mechanics.cast<RollingJet>(),
                   RollingJet(line_delay, slot(Parameter::kLineDelay)), motion.cast<RollingJet>()};
  jets.motion.angle.pan.v[2] = 1;
  jets.motion.angle.tilt.v[3] = 1;
  jets.motion.rate.pan.v[4] = 1;
  jets.motion.rate.tilt.v[5] = 1;
  jets.camera.focal_length.v[slot(Parameter::kFocalLength)] = 1;
  jets.camera.aspect.v[slot(Parameter::kAspect)] = 1;
  jets.camera.distortion.radial.v[slot(Parameter::kRadialDistortion)] = 1;
  jets.camera.centre_u.v[slot(Parameter::kCentreU)] = 1;
  jets.camera.centre_v.v[slot(Parameter::kCentreV)] = 1;
  jets.mechanics.pan_axis = direction_plus(
      jets.mechanics.pan_axis, variables<kVariables>(Vec2(0, 0), slot(Parameter::kPanAxis0)));
  jets.mechanics.tilt_axis = direction_plus(
      jets.mechanics.tilt_axis, variables<kVariables>(Vec2(0, 0), slot(Parameter::kTiltAxis0)));
  jets.mechanics.pan_scale.v[slot(Parameter::kPanScale)] = 1;
  jets.mechanics.tilt_scale.v[slot(Parameter::kTiltScale)] = 1;
  return jets;
}

TEST(Jet, RollingShutterJacobiansAreTheDerivatives) {
  int checked = 0;
  int refused = 0;
  for (const auto& named : test::hard_cameras()) {
    const Camera<double>& camera = named.camera;
    for (const Mechanics<double>& mechanics : test::hard_mechanics()) {
      for (const double line_delay : test::hard_line_delays()) {
        for (const FrameMotion<double>& motion : test::hard_motions()) {
          const RollingJets jets = rolling_jets(camera, mechanics, line_delay, motion);
          for (const Vec2& u : test::pixel_grid(named, 4)) {
            Vec3 d;
            Matrix<double, 3, kVariables> J_unproject;
            {
              Matrix<double, 3, 2> J_u;
              Matrix<double, 3, 4> J_motion;
              Matrix<double, 3, kParameterCount> J_parameters;
              ASSERT_EQ(rolling_shutter_unproject(camera, mechanics, line_delay, motion, u, &d,
                                                  &J_u, &J_motion, &J_parameters),
                        ProjectionStatus::kOk);
              J_unproject << J_u, J_motion, J_parameters;
            }
            Vector3<RollingJet> d_jet;
            ASSERT_EQ(rolling_shutter_unproject(jets.camera, jets.mechanics, jets.line_delay,
                                                jets.motion, variables<kVariables>(u), &d_jet),
                      ProjectionStatus::kOk);
            const double pixel = 1 / camera.focal_length;
            expect_columns_near<3, kVariables>(J_unproject, derivative(d_jet), 1e-11, pixel,
                                               named.name);

            Vec2 projected;
            Matrix<double, 2, kVariables> J_project;
            {
              Matrix<double, 2, 3> J_d;
              Matrix<double, 2, 4> J_motion;
              Matrix<double, 2, kParameterCount> J_parameters;
              if (rolling_shutter_project(camera, mechanics, line_delay, motion, d, &projected,
                                          &J_d, &J_motion,
                                          &J_parameters) != ProjectionStatus::kOk) {
                ++refused;
                continue;
              }
              J_project << J_d * tangent_basis(d), J_motion, J_parameters;
            }
            Vector2<RollingJet> u_jet;
            const Vector3<RollingJet> d_variable = direction_plus(
                Vector3<RollingJet>(d.cast<RollingJet>()), variables<kVariables>(Vec2(0, 0)));
            ASSERT_EQ(rolling_shutter_project(jets.camera, jets.mechanics, jets.line_delay,
                                              jets.motion, d_variable, &u_jet),
                      ProjectionStatus::kOk);
            // A second a row, the unit of the line delay, shifts images by f: hence the scale.
            expect_columns_near<2, kVariables>(J_project, derivative(u_jet), 1e-10,
                                               camera.focal_length, named.name);
            ++checked;
          }
        }
      }
    }
  }
  EXPECT_EQ(checked + refused, 9 * 3 * 4 * 8 * 16);
  // Corners of the barrel cameras' margins that are out of the model at the reference row.
  EXPECT_LE(refused, 10);
}

}  // namespace
}  // namespace alidade
