#include "core/model/rolling_shutter.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <limits>
#include <random>

#include "test/support/hard_values.h"
#include "test/support/numeric_jacobian.h"
#include "test/support/parameter_changes.h"

namespace alidade {
namespace {

using test::hard_cameras;
using test::hard_line_delays;
using test::hard_mechanics;
using test::hard_motions;
using test::numeric_jacobian;
using test::paper_mechanics;
using test::pixel_grid;

using Vec2 = Vector2<double>;
using Vec3 = Vector3<double>;
using Vec4 = Vector4<double>;
using test::ParameterVector;

// Everything that rolling_shutter_*() takes besides the pixel or the direction.
struct Setting {
  Camera<double> camera;
  Mechanics<double> mechanics;
  double line_delay = 0;
  FrameMotion<double> motion;

  [[nodiscard]] Setting plus_motion(const Vec4& e) const {
    Setting changed = *this;
    changed.motion.angle.pan += e[0];
    changed.motion.angle.tilt += e[1];
    changed.motion.rate.pan += e[2];
    changed.motion.rate.tilt += e[3];
    return changed;
  }

  // The scales and the clock offset change nothing while the true motion is held.
  [[nodiscard]] Setting plus_parameters(const ParameterVector& e) const {
    Calibration calibration;
    calibration.camera = camera;
    calibration.mechanics = mechanics;
    calibration.line_delay = line_delay;
    const Calibration changed = test::plus(calibration, e);
    return {changed.camera, changed.mechanics, changed.line_delay, motion};
  }

  [[nodiscard]] Vec4 motion_steps() const {
    const double pixel = 1 / camera.focal_length;
    return {pixel, pixel, 1e-3, 1e-3};
  }

  // The functions under test. Not inlined, or the compiler spends minutes on copies of them.
  [[nodiscard, gnu::noinline]] ProjectionStatus unproject(
      const Vec2& u, Vec3* d, Matrix<double, 3, 2>* J_u = nullptr,
      Matrix<double, 3, 4>* J_motion = nullptr,
      Matrix<double, 3, kParameterCount>* J_parameters = nullptr) const {
    return rolling_shutter_unproject(camera, mechanics, line_delay, motion, u, d, J_u, J_motion,
                                     J_parameters);
  }

  [[nodiscard, gnu::noinline]] ProjectionStatus project(
      const Vec3& d, Vec2* u, Matrix<double, 2, 3>* J_d = nullptr,
      Matrix<double, 2, 4>* J_motion = nullptr,
      Matrix<double, 2, kParameterCount>* J_parameters = nullptr) const {
    return rolling_shutter_project(camera, mechanics, line_delay, motion, d, u, J_d, J_motion,
                                   J_parameters);
  }

  [[nodiscard, gnu::noinline]] ProjectionStatus project_at(double row, const Vec3& d, Vec2* u,
                                                           Vec2* J_u_row = nullptr) const {
    return project_at_row(camera, mechanics, line_delay, motion, row, d, u, J_u_row);
  }

  [[nodiscard]] std::optional<Vec3> direction_of(const Vec2& u) const {
    Vec3 d;
    if (unproject(u, &d) != ProjectionStatus::kOk) return std::nullopt;
    return d;
  }

  [[nodiscard]] std::optional<Vec2> pixel_of(const Vec3& d) const {
    Vec2 u;
    if (project(d, &u) != ProjectionStatus::kOk) return std::nullopt;
    return u;
  }

  [[nodiscard]] std::optional<Vec2> pixel_at(double row, const Vec3& d) const {
    Vec2 u;
    if (project_at(row, d, &u) != ProjectionStatus::kOk) return std::nullopt;
    return u;
  }

  // d project_v / d row.
  [[nodiscard]] double slope(double row, const Vec3& d) const {
    Vec2 u;
    Vec2 J_u_row;
    EXPECT_EQ(project_at(row, d, &u, &J_u_row), ProjectionStatus::kOk);
    return J_u_row.y();
  }
};

std::vector<std::pair<test::NamedCamera, Setting>> hard_settings() {
  std::vector<std::pair<test::NamedCamera, Setting>> settings;
  for (const auto& named : hard_cameras()) {
    for (const auto& mechanics : hard_mechanics()) {
      for (const double line_delay : hard_line_delays()) {
        for (const auto& motion : hard_motions()) {
          settings.push_back({named, {named.camera, mechanics, line_delay, motion}});
        }
      }
    }
  }
  return settings;
}

// The paper's real camera, on a fast mount.
Setting paper_setting() {
  return {hard_cameras()[0].camera, paper_mechanics(), -14.2e-6, {{0.4, -0.2}, {0.3, -0.2}, 540}};
}

TEST(RollingShutter, MountAtRestSeesAsAGlobalShutter) {
  int checked = 0;
  for (const auto& [named, with_motion] : hard_settings()) {
    Setting setting = with_motion;
    setting.motion.rate = {0, 0};
    setting.motion.acceleration = {0, 0};
    setting.motion.zoom_rate = 0;
    const Matrix3<double> R = R_base_from_camera(setting.mechanics, setting.motion.angle);
    for (const Vec2& u : pixel_grid(named, 2)) {
      Vec3 d_c;
      ASSERT_EQ(unproject(setting.camera, u, &d_c), ProjectionStatus::kOk);
      const auto d_b = setting.direction_of(u);
      ASSERT_TRUE(d_b);
      EXPECT_LE((*d_b - R * d_c).norm(), 1e-15);
      ++checked;
    }
  }
  EXPECT_EQ(checked, 9 * 3 * 4 * 8 * 4);
}

TEST(RollingShutter, RowIsSeenFromTheOrientationAtItsTime) {
  // Panning right at 1 rad/s with 10 us a row: 500 rows below the reference row, 5 ms later.
  Setting setting;
  setting.camera = {1000, 1, {0}, 1280, 720};
  setting.motion = {{0.2, 0}, {1, 0}, 100};
  setting.line_delay = 10e-6;
  Vec3 d;
  ASSERT_EQ(setting.unproject({640, 600}, &d), ProjectionStatus::kOk);
  EXPECT_NEAR(std::atan2(d.y(), d.x()), 0.205, 1e-15);
  setting.line_delay = -10e-6;
  ASSERT_EQ(setting.unproject({640, 600}, &d), ProjectionStatus::kOk);
  EXPECT_NEAR(std::atan2(d.y(), d.x()), 0.195, 1e-15);
}

TEST(RollingShutter, ProjectInvertsUnproject) {
  int checked = 0;
  int refused_at_reference_row = 0;
  for (const auto& [named, setting] : hard_settings()) {
    for (const Vec2& u : pixel_grid(named, 7)) {
      const auto d = setting.direction_of(u);
      ASSERT_TRUE(d) << named.name;
      if (!setting.pixel_at(setting.motion.reference_row, *d)) {
        EXPECT_FALSE(setting.pixel_of(*d));
        ++refused_at_reference_row;
        continue;
      }
      const auto again = setting.pixel_of(*d);
      ASSERT_TRUE(again) << named.name << " " << u.transpose();
      // Rounding of about epsilon in the direction, times f, enlarged where the image nearly keeps
      // up with the read-out.
      const double tolerance = 1e-14 * (setting.camera.focal_length + setting.camera.width) /
                               (1 - setting.slope(u.y(), *d));
      EXPECT_LE((*again - u).norm(), tolerance) << named.name << " " << u.transpose();
      const auto d_again = setting.direction_of(*again);
      ASSERT_TRUE(d_again);
      EXPECT_LE((*d_again - *d).norm(), 1e-14);
      ++checked;
    }
  }
  EXPECT_EQ(checked + refused_at_reference_row, 9 * 3 * 4 * 8 * 49);
  // Corners of the barrel cameras' margins that have moved out of the model by the reference row.
  EXPECT_LE(refused_at_reference_row, 10);
}

TEST(RollingShutter, ProjectFindsTheOnlyRowThatADenseSearchFinds) {
  Setting setting = paper_setting();
  int found = 0;
  for (const double line_delay : {-14.2e-6, 14.2e-6, 30e-6, -30e-6}) {
    setting.line_delay = line_delay;
    for (double pan = 0.36; pan < 0.44; pan += 0.007) {
      for (double tilt = -0.24; tilt < -0.16; tilt += 0.007) {
        const Vec3 d = R_base_from_camera(setting.mechanics, {pan, tilt}) * Vec3::UnitZ();
        const auto miss = [&](double row) {
          const auto u = setting.pixel_at(row, d);
          EXPECT_TRUE(u);
          return u ? u->y() - row : 0;
        };
        std::vector<double> rows;
        constexpr double kStep = 50;
        for (double row = -4000; row < 5000; row += kStep) {
          double low = row;
          double high = row + kStep;
          if ((miss(low) < 0) == (miss(high) < 0)) continue;
          for (int i = 0; i < 60; ++i) {
            const double middle = (low + high) / 2;
            ((miss(low) < 0) == (miss(middle) < 0) ? low : high) = middle;
          }
          rows.push_back(low);
        }
        ASSERT_EQ(rows.size(), 1u);
        const auto u = setting.pixel_of(d);
        ASSERT_TRUE(u);
        EXPECT_NEAR(u->y(), rows[0], 1e-8);
        ++found;
      }
    }
  }
  EXPECT_EQ(found, 4 * 12 * 12);
}

TEST(RollingShutter, RowsOutsideTheImageHaveSolutionsToo) {
  const Setting setting = paper_setting();
  for (const double row : {-2000.0, -1.0, 1081.0, 3000.0}) {
    const auto d = setting.direction_of({960, row});
    ASSERT_TRUE(d);
    const auto u = setting.pixel_of(*d);
    ASSERT_TRUE(u);
    EXPECT_NEAR(u->y(), row, 1e-8);
  }
}

TEST(RollingShutter, NoRowSeesWhatMovesDownAsFastAsTheReadOut) {
  // The image moves by f tilt' = 96,000 px/s; the read-out by 1 / 14.2 us = 70,423 rows/s.
  Setting setting = paper_setting();
  const Vec3 ahead = R_base_from_camera(setting.mechanics, setting.motion.angle) * Vec3::UnitZ();
  int refused = 0;
  for (const double sign : {1.0, -1.0}) {
    setting.line_delay = sign * 14.2e-6;
    Vec2 u(-1, -2);
    setting.motion.rate = {0, sign * 3};
    EXPECT_EQ(setting.project(ahead, &u), ProjectionStatus::kNoRow);
    EXPECT_EQ(u, Vec2(-1, -2)) << "a refusal writes nothing";
    ++refused;
    // Against the read-out any speed is seen, once.
    setting.motion.rate = {0, -sign * 3};
    EXPECT_TRUE(setting.pixel_of(ahead));
  }
  EXPECT_EQ(refused, 2);
}

// Even where the search for a row would lead far away, behind the camera or to a row of another moment.
TEST(RollingShutter, NoRowIsAllThatIsSaidOfWhatOutrunsTheReadOut) {
  Setting setting = paper_setting();
  setting.line_delay = 14.2e-6;
  for (const double tilt_rate : {2.5, 3.0, 10.0, 300.0}) {
    for (const double tilt_acceleration : {0.0, -1e3, -1e5}) {
      setting.motion.rate = {0.1, tilt_rate};
      setting.motion.acceleration = {0, tilt_acceleration};
      for (int place = 0; place < 25; ++place) {
        const Vec2 u(setting.camera.width * (place % 5) / 4.0,
                     setting.camera.height * (place / 5) / 4.0);
        Vec3 d_c;
        ASSERT_EQ(unproject(setting.camera, u, &d_c), ProjectionStatus::kOk);
        const Vec3 d = R_base_from_camera(setting.mechanics, setting.motion.angle) * d_c;
        Vec2 seen;
        EXPECT_EQ(setting.project(d, &seen), ProjectionStatus::kNoRow)
            << tilt_rate << ' ' << tilt_acceleration << ' ' << u.transpose();
      }
    }
  }
}

TEST(RollingShutter, PassesOnTheCamerasRefusals) {
  const Setting setting = paper_setting();
  Vec2 u;
  Vec3 d;
  const auto project_status = [&](const Setting& s, const Vec3& direction) {
    return s.project(direction, &u);
  };
  const auto unproject_status = [&](const Setting& s, const Vec2& pixel) {
    return s.unproject(pixel, &d);
  };
  EXPECT_EQ(project_status(setting, {-1, 0, 0}), ProjectionStatus::kBehindCamera);
  Setting barrel = setting;
  barrel.camera.distortion.radial = -55.4;
  EXPECT_EQ(project_status(barrel, Vec3(1, 0.8, 0).normalized()),
            ProjectionStatus::kBeyondDistortionLimit);
  EXPECT_EQ(unproject_status(barrel, {5000, 540}), ProjectionStatus::kBeyondDistortionLimit);

  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(project_status(setting, {1, nan, 0}), ProjectionStatus::kNotFinite);
  EXPECT_EQ(unproject_status(setting, {nan, 0}), ProjectionStatus::kNotFinite);
  int refused = 0;
  const Vec3 ahead = *setting.direction_of({960, 540});
  for (int i = 0; i < 4; ++i) {
    const Setting bad = setting.plus_motion(nan * Vec4::Unit(i));
    EXPECT_EQ(project_status(bad, ahead), ProjectionStatus::kNotFinite);
    EXPECT_EQ(unproject_status(bad, {960, 0}), ProjectionStatus::kNotFinite);
    ++refused;
  }
  EXPECT_EQ(refused, 4);
}

TEST(RollingShutter, JacobiansOfUnprojectAgreeWithNumericOnes) {
  int checked = 0;
  int evaluated = 0;
  for (const auto& [named, setting_at] : hard_settings()) {
    const Setting& setting = setting_at;
    for (const Vec2& u_at : pixel_grid(named, 2)) {
      const Vec2& u = u_at;
      Vec3 d;
      Matrix<double, 3, 2> J_u;
      Matrix<double, 3, 4> J_motion;
      Matrix<double, 3, kParameterCount> J_parameters;
      ASSERT_EQ(setting.unproject(u, &d, &J_u, &J_motion, &J_parameters), ProjectionStatus::kOk);
      const auto numeric_u =
          numeric_jacobian<3, 2>([&](const Vec2& e) { return setting.direction_of(u + e); }, 1.0);
      const auto numeric_motion = numeric_jacobian<3, 4>(
          [&](const Vec4& e) { return setting.plus_motion(e).direction_of(u); },
          setting.motion_steps());
      const auto numeric_parameters = numeric_jacobian<3, kParameterCount>(
          [&](const ParameterVector& e) { return setting.plus_parameters(e).direction_of(u); },
          test::parameter_steps(setting.camera));
      // Directions carry a rounding of a few epsilon.
      EXPECT_LT(test::disagreement(J_u, numeric_u, 2e-15), 1) << named.name;
      EXPECT_LT(test::disagreement(J_motion, numeric_motion, 2e-15), 1) << named.name;
      EXPECT_LT(test::disagreement(J_parameters, numeric_parameters, 2e-15), 1) << named.name;
      evaluated += numeric_u.evaluated + numeric_motion.evaluated + numeric_parameters.evaluated;
      ++checked;
    }
  }
  EXPECT_EQ(checked, 9 * 3 * 4 * 8 * 4);
  EXPECT_EQ(evaluated, checked * 4 * (2 + 4 + kParameterCount));
}

TEST(RollingShutter, JacobiansOfProjectAgreeWithNumericOnes) {
  int checked = 0;
  int refused_at_reference_row = 0;
  int evaluated = 0;
  for (const auto& [named, setting_at] : hard_settings()) {
    const Setting& setting = setting_at;
    for (const Vec2& u_at : pixel_grid(named, 2)) {
      const auto unprojected = setting.direction_of(u_at);
      ASSERT_TRUE(unprojected);
      const Vec3 d = *unprojected;
      Vec2 u;
      Matrix<double, 2, 3> J_d;
      Matrix<double, 2, 4> J_motion;
      Matrix<double, 2, kParameterCount> J_parameters;
      if (!setting.pixel_at(setting.motion.reference_row, d)) {
        ++refused_at_reference_row;
        continue;
      }
      ASSERT_EQ(setting.project(d, &u, &J_d, &J_motion, &J_parameters), ProjectionStatus::kOk);
      const double pixel = 1 / setting.camera.focal_length;
      const auto numeric_d = numeric_jacobian<2, 2>(
          [&](const Vec2& e) { return setting.pixel_of(direction_plus(d, e)); }, pixel);
      const auto numeric_motion =
          numeric_jacobian<2, 4>([&](const Vec4& e) { return setting.plus_motion(e).pixel_of(d); },
                                 setting.motion_steps());
      const auto numeric_parameters = numeric_jacobian<2, kParameterCount>(
          [&](const ParameterVector& e) { return setting.plus_parameters(e).pixel_of(d); },
          test::parameter_steps(setting.camera));
      const Matrix<double, 2, 2> J_tangent = J_d * tangent_basis(d);
      // The rounding of a direction, in pixels, up to ten times larger as the slope is below 0.9.
      const double noise = 1e-14 * (setting.camera.focal_length + setting.camera.width);
      EXPECT_LT(test::disagreement(J_tangent, numeric_d, noise), 1) << named.name;
      EXPECT_LT(test::disagreement(J_motion, numeric_motion, noise), 1) << named.name;
      EXPECT_LT(test::disagreement(J_parameters, numeric_parameters, noise), 1) << named.name;
      evaluated += numeric_d.evaluated + numeric_motion.evaluated + numeric_parameters.evaluated;
      ++checked;
    }
  }
  EXPECT_EQ(checked + refused_at_reference_row, 9 * 3 * 4 * 8 * 4);
  EXPECT_LE(refused_at_reference_row, 10);
  EXPECT_EQ(evaluated, checked * 4 * (2 + 4 + kParameterCount));
}

TEST(RollingShutter, MotionMadeFromMeasurementsFollowsScalesAndClock) {
  Mechanics<double> mechanics = paper_mechanics();
  mechanics.pan_scale = 1.02;
  mechanics.tilt_scale = 0.97;
  const FrameMotion<double> motion{{2.5, -0.7}, {0.3, -0.2}, 540};
  const PanTilt<double> measured = measured_from_true(mechanics, motion.angle);
  const PanTilt<double> measured_rate = measured_from_true(mechanics, motion.rate);
  const auto numeric = numeric_jacobian<4, kParameterCount>(
      [&](const ParameterVector& e) -> std::optional<Vec4> {
        Mechanics<double> changed = mechanics;
        changed.pan_scale += e[index(Parameter::kPanScale)];
        changed.tilt_scale += e[index(Parameter::kTiltScale)];
        const double later = e[index(Parameter::kClockOffset)];
        const PanTilt<double> angle = true_from_measured<double>(
            changed,
            {measured.pan + measured_rate.pan * later, measured.tilt + measured_rate.tilt * later});
        const PanTilt<double> rate = true_from_measured(changed, measured_rate);
        return Vec4(angle.pan, angle.tilt, rate.pan, rate.tilt);
      },
      1e-3);
  EXPECT_EQ(numeric.evaluated, 4 * kParameterCount);
  EXPECT_LT(test::disagreement(motion_parameter_jacobian(mechanics, motion), numeric, 1e-15), 1);
}

// Whether errors have the covariance predicted for them. Whitened by it, the sample covariance of N
// errors has the expectation I and the standard deviations sqrt(2 / N) on the diagonal, sqrt(1 / N)
// off it; five of these are allowed.
void expect_covariance(const std::vector<Vec2>& errors, const Matrix2<double>& predicted) {
  const Eigen::LLT<Matrix2<double>> cholesky(predicted);
  ASSERT_EQ(cholesky.info(), Eigen::Success);
  Matrix2<double> sample = Matrix2<double>::Zero();
  for (const Vec2& error : errors) {
    const Vec2 white = cholesky.matrixL().solve(error);
    sample += white * white.transpose();
  }
  const double n = static_cast<double>(errors.size());
  sample /= n;
  EXPECT_NEAR(sample(0, 0), 1, 5 * std::sqrt(2 / n));
  EXPECT_NEAR(sample(1, 1), 1, 5 * std::sqrt(2 / n));
  EXPECT_NEAR(sample(0, 1), 0, 5 * std::sqrt(1 / n));
}

class Noise {
 public:
  explicit Noise(unsigned seed) : generator_(seed) {}

  // A sample of the covariance `factor factor^T`.
  template <int kSize>
  Matrix<double, kSize, 1> operator()(const Matrix<double, kSize, kSize>& factor) {
    Matrix<double, kSize, 1> white;
    for (int i = 0; i < kSize; ++i) white[i] = normal_(generator_);
    return factor * white;
  }

 private:
  std::mt19937_64 generator_;
  std::normal_distribution<double> normal_;
};

constexpr int kSamples = 10000;

TEST(RollingShutter, ReprojectionErrorHasThePredictedCovariance) {
  Setting setting = paper_setting();
  setting.line_delay = 30e-6;
  Matrix2<double> factor;
  factor << 0.5, 0, 0.2, 0.8;
  int checked = 0;
  for (const PanTilt<double> rate :
       {PanTilt<double>{0, 0}, {0.5, 0.6}, {-0.5, -0.8}, {0.9, -0.1}}) {
    setting.motion.rate = rate;
    const Vec2 u(300, 900);
    const Vec3 d = *setting.direction_of(u);
    Vec2 projected;
    Vec2 J_u_row;
    ASSERT_EQ(setting.project_at(u.y(), d, &projected, &J_u_row), ProjectionStatus::kOk);
    Noise noise(1);
    std::vector<Vec2> errors;
    for (int i = 0; i < kSamples; ++i) {
      const Vec2 observed = u + noise(factor);
      errors.push_back(observed - *setting.pixel_at(observed.y(), d));
    }
    expect_covariance(errors,
                      reprojection_error_covariance<double>(J_u_row, factor * factor.transpose()));
    ++checked;
  }
  EXPECT_EQ(checked, 4);
}

TEST(RollingShutter, DirectionOfAPixelHasThePredictedCovariance) {
  // The paper's camera and its uncertainties, larger where they would drown in the others.
  Matrix2<double> pixel_factor;
  pixel_factor << 1, 0, 0.3, 0.7;
  Matrix4<double> motion_factor = Vec4(5e-5, 4e-5, 2e-2, 3e-2).asDiagonal();
  motion_factor(1, 0) = 2e-5;
  motion_factor(2, 0) = -1e-2;
  ParameterVector sigmas;
  sigmas << 48, 1e-3, 2, 1.5, 2.5, 1e-7, 1e-4, 2e-4, 1e-4, 2e-4, 1e-4, 2e-4, 1e-4;
  ParameterCovariance<double> parameter_factor = sigmas.asDiagonal();
  parameter_factor(index(Parameter::kPanScale), index(Parameter::kFocalLength)) = 1e-4;
  parameter_factor(index(Parameter::kTiltAxis1), index(Parameter::kPanAxis0)) = -1e-4;

  int checked = 0;
  for (const double line_delay : {-14.2e-6, 0.0, 30e-6}) {
    for (const double pan : {0.4, kPi - 1e-5}) {
      for (const Vec2& u : {Vec2(10, 20), Vec2(960, 540), Vec2(1500, 1070)}) {
        Setting setting = paper_setting();
        setting.line_delay = line_delay;
        setting.motion.angle.pan = pan;
        const PanTilt<double> measured =
            measured_from_true(setting.mechanics, setting.motion.angle);
        const PanTilt<double> measured_rate =
            measured_from_true(setting.mechanics, setting.motion.rate);

        Vec3 d;
        Matrix<double, 3, 2> J_u;
        Matrix<double, 3, 4> J_motion;
        Matrix<double, 3, kParameterCount> J_parameters;
        ASSERT_EQ(setting.unproject(u, &d, &J_u, &J_motion, &J_parameters), ProjectionStatus::kOk);
        J_parameters += J_motion * motion_parameter_jacobian(setting.mechanics, setting.motion);
        const Matrix2<double> predicted = direction_covariance<double>(
            d, J_u, J_motion, J_parameters, pixel_factor * pixel_factor.transpose(),
            motion_factor * motion_factor.transpose(),
            parameter_factor * parameter_factor.transpose());

        Noise noise(2);
        std::vector<Vec2> errors;
        for (int i = 0; i < kSamples; ++i) {
          const ParameterVector e = noise(parameter_factor);
          Setting guess = setting.plus_parameters(e);
          const double later = e[index(Parameter::kClockOffset)];
          guess.motion.angle = true_from_measured<double>(
              guess.mechanics, {measured.pan + measured_rate.pan * later,
                                measured.tilt + measured_rate.tilt * later});
          guess.motion.rate = true_from_measured(guess.mechanics, measured_rate);
          guess = guess.plus_motion(noise(motion_factor));
          const auto seen = guess.direction_of(u + noise(pixel_factor));
          ASSERT_TRUE(seen);
          errors.push_back(direction_minus(*seen, d));
        }
        expect_covariance(errors, predicted);
        ++checked;
      }
    }
  }
  EXPECT_EQ(checked, 18);
}

}  // namespace
}  // namespace alidade
