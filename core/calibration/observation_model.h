#pragma once
// ObservationModel: the forward model of one observation of a landmark, with its error and the
// derivatives of its projection, as the normal equations (linearisation.h) take them. Inline, for
// the loop over all observations. Nothing allocates or throws.

#include <Eigen/Core>
#include <cstddef>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

using CameraJacobian = Eigen::Matrix<double, 2, kObservedCount>;

// Downward image motion per row read out, in rows. Beyond this a landmark meets the read-out in no
// definite row.
inline constexpr double kMaxRowSlope = 0.9;

// The model of one state, which must outlive it and must not change.
struct ObservationModel {
  const Camera<double> camera;
  const Mechanics<double>& mechanics;
  const double line_delay;
  const CornerDistortion<double> distortion_unit;
  Matrix3<double> R_base_from_anchor;
  Matrix<double, 3, 4> J_xi_axes_anchor;

  explicit ObservationModel(const AdjustmentState& state)
      : camera(state.physical_camera()),
        mechanics(state.mechanics),
        line_delay(state.line_delay()),
        distortion_unit(corner_unit(state.camera)) {
    J_xi_axes_anchor.setZero();
    R_base_from_anchor =
        R_base_from_camera(state.mechanics, state.anchor, nullptr, &J_xi_axes_anchor);
  }

  // A landmark's direction in the base, with its derivatives by the change of its direction and by
  // those of the axes (rad).
  struct Landmark {
    Vector3<double> d_b;
    Matrix<double, 3, 2> J_db_landmark;
    Matrix<double, 3, 4> J_db_axes;
  };
  // d_anchor: as in AdjustmentState::landmarks.
  [[nodiscard]] Landmark turn(const Vector3<double>& d_anchor) const {
    return {R_base_from_anchor * d_anchor, R_base_from_anchor * tangent_basis(d_anchor),
            -R_base_from_anchor * (skew(d_anchor) * J_xi_axes_anchor)};
  }

  struct Result {
    Vector2<double> error;
    Matrix2<double> J_angle;
    Matrix2<double> J_landmark;
    Vector2<double> J_nearness;
    CameraJacobian J_camera;

    // J_nearness with the direction of landmark l eliminated. The state must have nearness.
    [[nodiscard]] Vector2<double> J_nearness_alone(const Linearisation& at, std::size_t l) const {
      return J_nearness - J_landmark * at.direction_by_nearness[l];
    }
  };

  // Error (measured minus predicted) and derivatives of the prediction, in units of sigma. angle,
  // rate: of the trajectory at the observed row. row: if not null, its last four members are set,
  // too. False: there is no projection, or the motion is beyond kMaxRowSlope.
  [[nodiscard]] bool evaluate(const AdjustmentObservation& observation,
                              const PanTilt<double>& angle, const PanTilt<double>& rate,
                              const Landmark& landmark, double nearness, Result* out,
                              ObservationRow* row = nullptr) const {
    Matrix<double, 3, 2> J_xi_angle;
    Matrix<double, 3, 4> J_xi_axes;
    const Matrix3<double> R = R_base_from_camera(mechanics, angle, &J_xi_angle, &J_xi_axes);
    const Vector3<double> d_far = R.transpose() * landmark.d_b;
    const Vector3<double> d_c = d_far - nearness * Vector3<double>::UnitZ();
    Vector2<double> u;
    Matrix<double, 2, 3> J_u_dc;
    Matrix<double, 2, kCameraParameterCount> J_u_camera;
    if (project(camera, d_c, &u, &J_u_dc, &J_u_camera) != ProjectionStatus::kOk) return false;
    const Matrix<double, 2, 3> J_u_xi = J_u_dc * skew(d_far);
    const Matrix2<double> J_u_angle = J_u_xi * J_xi_angle;
    const Vector2<double> J_u_time = J_u_angle * rate.vector();
    const Vector2<double> J_u_row = J_u_time * line_delay;
    if (J_u_row.y() > kMaxRowSlope) return false;

    Matrix2<double> whiten;  // A^-1 / sigma
    whiten << 1, J_u_row.x() / (1 - J_u_row.y()), 0, 1 / (1 - J_u_row.y());
    whiten /= observation.sigma;
    out->error = whiten * (observation.u - u);
    out->J_angle = whiten * J_u_angle;
    const Matrix<double, 2, 3> J_u_db = J_u_dc * R.transpose();
    out->J_landmark = whiten * (J_u_db * landmark.J_db_landmark);
    out->J_nearness = -(whiten * J_u_dc.col(2));
    CameraJacobian J;
    J.col(camera_column::kFocalLength) = by_zoom(camera, J_u_camera);
    J.col(camera_column::kAspect) = camera.aspect * J_u_camera.col(camera_column::kAspect);
    for (int i = 0; i < kDistortionCount; ++i) {
      const int column = camera_column::kDistortion + i;
      J.col(column) = distortion_unit[i] * J_u_camera.col(column);
    }
    J.middleCols<2>(camera_column::kCentreU) = J_u_camera.middleCols<2>(camera_column::kCentreU);
    J.col(index(Parameter::kLineDelay)) = J_u_time * (observation.u.y() / camera.height);
    J.rightCols<4>() = J_u_xi * J_xi_axes + J_u_db * landmark.J_db_axes;
    out->J_camera = whiten * J;
    if (row != nullptr) {
      row->whiten = whiten;
      row->d_c = d_c;
      row->J_u_dc = J_u_dc;
      row->u_rate = J_u_time;
    }
    return true;
  }
};

// 0 if the state has none.
[[nodiscard]] inline double nearness_of(const AdjustmentState& state, int landmark) {
  return state.nearness.empty() ? 0 : state.nearness[static_cast<std::size_t>(landmark)];
}

}  // namespace alidade::internal
