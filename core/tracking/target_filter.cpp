#include "core/tracking/target_filter.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>

#include "core/model/angle.h"
#include "core/model/rotation.h"
#include "core/model/trigonometry.h"

namespace alidade {

namespace {

// Moves the chart's origin to the place's mean, along the great circle.
void follow_place(TargetState* state) {
  const Vector3<double> turn(0, state->mean[1], state->mean[0]);
  const double angle = turn.norm();
  if (angle > 0) {
    state->R_base_from_chart =
        (state->R_base_from_chart * Eigen::AngleAxisd(angle, turn / angle)).eval();
    // Products of rotations drift; one Newton step restores orthogonality.
    const Matrix3<double> R = state->R_base_from_chart;
    state->R_base_from_chart = 1.5 * R - 0.5 * R * (R.transpose() * R);
  }
  state->mean.head<2>().setZero();
}

// Columns: derivative of the direction by azimuth and elevation of the chart.
Matrix<double, 3, 2> chart_tangents(const Matrix3<double>& R_base_from_chart) {
  Matrix<double, 3, 2> tangents;
  tangents << R_base_from_chart.col(1), -R_base_from_chart.col(2);
  return tangents;
}

// Base axes (forward, right, down) turned so that x is the direction.
Matrix3<double> chart_at(const Vector3<double>& d) {
  const Vector3<double> right(-d.y(), d.x(), 0);
  Matrix3<double> R;
  R.col(0) = d;
  R.col(1) = right.norm() > 1e-9 ? Vector3<double>(right.normalized()) : Vector3<double>::UnitY();
  R.col(2) = d.cross(R.col(1)).normalized();
  R.col(1) = R.col(2).cross(d);
  return R;
}

}  // namespace

std::optional<TargetState> first_state(TargetSpace space,
                                       const Matrix3<double>& H_measured_from_world,
                                       const TargetMeasurement& measurement,
                                       double sigma_velocity) {
  const Vector3<double> w = H_measured_from_world.inverse() * measurement.place.homogeneous();
  TargetState state;
  if (space == TargetSpace::kPlane) {
    if (!(std::abs(w.z()) > 1e-12 * w.norm())) return std::nullopt;
    state.mean.head<2>() = w.head<2>() / w.z();
  } else {
    if (!(w.norm() > 0)) return std::nullopt;
    state.R_base_from_chart = chart_at(w.normalized());
  }
  const std::optional<ExpectedPlace> expected = expected_place(space, state, H_measured_from_world);
  if (!expected) return std::nullopt;
  const Matrix2<double> inverse = expected->J_place_position.inverse();
  state.cov.setZero();
  state.cov.topLeftCorner<2, 2>() = inverse * measurement.cov * inverse.transpose();
  state.cov.bottomRightCorner<2, 2>().diagonal().setConstant(sigma_velocity * sigma_velocity);
  state.cov = symmetric(state.cov);
  if (!all_finite(state.mean) || !all_finite(state.cov) || !all_finite(state.R_base_from_chart)) {
    return std::nullopt;
  }
  return state;
}

void predict_target(TargetSpace space, double dt_s, double acceleration_density,
                    TargetState* state) {
  Matrix4<double> A = Matrix4<double>::Identity();
  A(0, 2) = dt_s;
  A(1, 3) = dt_s;
  state->mean.head<2>() += dt_s * state->mean.tail<2>();
  state->cov = (A * state->cov * A.transpose()).eval();
  for (int i = 0; i < 2; ++i) {
    state->cov(i, i) += acceleration_density * dt_s * dt_s * dt_s / 3;
    state->cov(i, i + 2) += acceleration_density * dt_s * dt_s / 2;
    state->cov(i + 2, i) += acceleration_density * dt_s * dt_s / 2;
    state->cov(i + 2, i + 2) += acceleration_density * dt_s;
  }
  state->cov = symmetric(state->cov);
  if (space == TargetSpace::kSphere) follow_place(state);
}

std::optional<ExpectedPlace> expected_place(TargetSpace space, const TargetState& state,
                                            const Matrix3<double>& H_measured_from_world) {
  Vector3<double> world;
  Matrix<double, 3, 2> J_world_position;
  if (space == TargetSpace::kPlane) {
    world << state.mean[0], state.mean[1], 1;
    J_world_position << 1, 0, 0, 1, 0, 0;
  } else {
    world = state.R_base_from_chart.col(0);
    J_world_position = chart_tangents(state.R_base_from_chart);
  }
  const Vector3<double> w = H_measured_from_world * world;
  if (!(w.z() > 1e-12 * w.norm())) return std::nullopt;
  ExpectedPlace expected;
  expected.place = w.head<2>() / w.z();
  const Matrix<double, 3, 2> J = H_measured_from_world * J_world_position;
  expected.J_place_position = (J.topRows<2>() - expected.place * J.row(2)) / w.z();
  expected.cov = expected.J_place_position * state.cov.topLeftCorner<2, 2>() *
                 expected.J_place_position.transpose();
  return expected;
}

Innovation innovation_of(const ExpectedPlace& expected, const TargetMeasurement& measurement) {
  Innovation innovation;
  innovation.difference = measurement.place - expected.place;
  const Matrix2<double> S = expected.cov + measurement.cov;
  const double determinant = S(0, 0) * S(1, 1) - S(0, 1) * S(1, 0);
  innovation.inverse_cov << S(1, 1), -S(0, 1), -S(1, 0), S(0, 0);
  innovation.inverse_cov /= determinant;
  innovation.distance_squared =
      innovation.difference.dot(innovation.inverse_cov * innovation.difference);
  innovation.density =
      std::exp(-0.5 * innovation.distance_squared) / (2 * kPi * std::sqrt(determinant));
  return innovation;
}

void update_target(TargetSpace space, const ExpectedPlace& expected, const Innovation* innovations,
                   const double* weights, int count, TargetState* state) {
  const Matrix<double, 4, 2> covJ =
      state->cov.leftCols<2>() * expected.J_place_position.transpose();
  Vector4<double> mean_step = Vector4<double>::Zero();
  Matrix4<double> less = Matrix4<double>::Zero();
  Matrix4<double> spread = Matrix4<double>::Zero();
  for (int i = 0; i < count; ++i) {
    const Matrix<double, 4, 2> W = covJ * innovations[i].inverse_cov;
    const Vector4<double> step = W * innovations[i].difference;
    mean_step += weights[i] * step;
    less += weights[i] * W * covJ.transpose();  // W S W^T
    spread += weights[i] * step * step.transpose();
  }
  state->mean += mean_step;
  state->cov += spread - less - mean_step * mean_step.transpose();
  state->cov = symmetric(state->cov);
  if (space == TargetSpace::kSphere) follow_place(state);
}

Vector3<double> target_direction(const TargetState& state) {
  return state.R_base_from_chart.col(0);
}

std::optional<AzimuthElevation> azimuth_elevation(const TargetState& state) {
  const Vector3<double> d = target_direction(state);
  const double cos_el = std::hypot(d.x(), d.y());
  if (!(cos_el > 1e-6)) return std::nullopt;
  const double sin_el = -d.z();
  const Vector3<double> right(-d.y() / cos_el, d.x() / cos_el, 0);
  const Vector3<double> up(-sin_el * d.x() / cos_el, -sin_el * d.y() / cos_el, -cos_el);
  Matrix<double, 2, 3> rows;
  rows << right.transpose(), up.transpose();
  const Matrix2<double> turn = rows * chart_tangents(state.R_base_from_chart);
  const Vector2<double> v = turn * state.mean.tail<2>();

  AzimuthElevation result;
  result.value << wrap_angle(std::atan2(d.y(), d.x())), std::atan2(sin_el, cos_el), v[0] / cos_el,
      v[1];
  // A velocity that moves with the place turns against the circles of elevation by sin(el) d
  // azimuth.
  Matrix4<double> J = Matrix4<double>::Zero();
  J(0, 0) = 1 / cos_el;
  J(1, 1) = 1;
  J(2, 0) = v[1] * sin_el / (cos_el * cos_el);
  J(2, 1) = v[0] * sin_el / (cos_el * cos_el);
  J(2, 2) = 1 / cos_el;
  J(3, 0) = -v[0] * sin_el / cos_el;
  J(3, 3) = 1;
  Matrix4<double> turns = Matrix4<double>::Zero();
  turns.topLeftCorner<2, 2>() = turn;
  turns.bottomRightCorner<2, 2>() = turn;
  J = (J * turns).eval();
  result.cov = J * state.cov * J.transpose();
  return result;
}

}  // namespace alidade
