#include "core/calibration/linearisation.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/calibration/nearness_columns.h"
#include "core/calibration/observation_model.h"

namespace alidade::internal {

namespace {

struct RobustCost {
  double cost;
  double weight;
};

RobustCost robust_cost(double squared_error, double scale) {
  if (std::isinf(scale)) return {squared_error, 1};
  const double c = scale * scale;
  return {c * std::log1p(squared_error / c), 1 / (1 + squared_error / c)};
}

// Cost of an observation without a projection: it must not pay to lose one.
constexpr double kLostSquaredError = 1e10;

// Adds J^T J (x) w w^T to H's block of four control points, lower triangle.
void add_control_points(const TrajectorySpline::Basis& basis, const Matrix2<double>& J_squared,
                        NormalMatrix* H) {
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j <= i; ++j) {
      H->points(basis.segment + i, basis.segment + j) +=
          basis.weight[i] * basis.weight[j] * J_squared;
    }
  }
}

}  // namespace

Camera<double> AdjustmentState::physical_camera() const {
  Camera<double> physical = camera;
  set_corner_distortion(corner_distortion, &physical);
  return physical;
}

TelemetryJacobian telemetry_jacobian(const Mechanics<double>& mechanics,
                                     const AdjustmentTelemetry& sample, double since_reference_s,
                                     const Vector2<double>& angle, const Vector2<double>& rate) {
  const Vector2<double> scale(mechanics.pan_scale, mechanics.tilt_scale);
  TelemetryJacobian J;
  J << angle[0], 0, -scale[0] * rate[0], scale[0] * rate[0] * since_reference_s,  //
      0, angle[1], -scale[1] * rate[1], scale[1] * rate[1] * since_reference_s;
  return sample.sigma.cwiseInverse().asDiagonal() * J;
}

void apply_step(const Eigen::VectorXd& x, const std::vector<Vector2<double>>& x_landmark,
                AdjustmentState* state) {
  const int control_points = state->trajectory.control_points();
  for (int i = 0; i < control_points; ++i) {
    state->trajectory.control_point(i) += x.segment<2>(2 * i);
  }
  const GlobalVector global = x.tail<kGlobalCount>();
  state->camera.focal_length *= std::exp(global[index(Parameter::kFocalLength)]);
  state->camera.aspect *= std::exp(global[index(Parameter::kAspect)]);
  state->corner_distortion += global.segment<kDistortionCount>(camera_column::kDistortion);
  state->camera.centre_u += global[index(Parameter::kCentreU)];
  state->camera.centre_v += global[index(Parameter::kCentreV)];
  state->readout_s += global[index(Parameter::kLineDelay)];
  Mechanics<double>& mechanics = state->mechanics;
  mechanics.pan_axis = direction_plus<double>(
      mechanics.pan_axis, Vector2<double>(global.segment<2>(index(Parameter::kPanAxis0))));
  mechanics.tilt_axis = direction_plus<double>(
      mechanics.tilt_axis, Vector2<double>(global.segment<2>(index(Parameter::kTiltAxis0))));
  mechanics.pan_scale += global[index(Parameter::kPanScale)];
  mechanics.tilt_scale += global[index(Parameter::kTiltScale)];
  state->shift_s += global[index(Parameter::kClockOffset)];
  state->drift += global[kDrift];
  for (std::size_t i = 0; i < std::min(state->landmarks.size(), x_landmark.size()); ++i) {
    state->landmarks[i] = direction_plus<double>(state->landmarks[i], x_landmark[i]).normalized();
  }
  for (std::size_t i = 0; i < state->nearness.size(); ++i)
    state->nearness[i] += x_landmark[state->landmarks.size() + i][0];
  mechanics.pan_axis.normalize();
  mechanics.tilt_axis.normalize();
}

void Lineariser::linearise(const AdjustmentState& state, const LossScales& loss,
                           Linearisation* out) {
  const int control_points = state.trajectory.control_points();
  out->cost = 0;
  out->valid = true;
  out->H.set_zero(control_points);
  out->g.setZero(out->H.rows());
  add_observations(state, loss, out);
  add_telemetry(state, loss, out);
  add_priors(state, out);
  fix_parameters(out);
}

void Lineariser::add_observations(const AdjustmentState& state, const LossScales& loss,
                                  Linearisation* out) {
  const ObservationModel model(state);
  const TrajectorySpline& trajectory = state.trajectory;
  const int camera_row = 2 * trajectory.control_points();
  const std::size_t landmarks = state.landmarks.size();
  out->observations.resize(data_.observations.size());
  out->H_landmark.assign(landmarks, Matrix2<double>::Zero());
  out->g_landmark.assign(landmarks, Vector2<double>::Zero());
  out->H_camera.assign(landmarks, Eigen::Matrix<double, kObservedCount, 2>::Zero());
  out->touched.clear();
  out->H_touched.clear();
  out->touched_begin.assign(1, 0);
  out->direction_by_nearness.clear();
  out->nearness_unknowns = 0;
  touched_buffer_.assign(static_cast<std::size_t>(trajectory.control_points()),
                         Matrix2<double>::Zero());
  is_touched_.assign(static_cast<std::size_t>(trajectory.control_points()), false);

  Eigen::Matrix<double, kObservedCount, kObservedCount> H_cc;
  H_cc.setZero();
  Eigen::Matrix<double, kObservedCount, 1> g_c;
  g_c.setZero();
  std::vector<int> touched_now;
  NearnessColumns nearness(priors_.nearness_information);
  const bool has_nearness = !state.nearness.empty();
  std::size_t next = 0;
  for (std::size_t l = 0; l < landmarks; ++l) {
    const ObservationModel::Landmark landmark = model.turn(state.landmarks[l]);
    if (has_nearness) nearness.begin(state.nearness[l], trajectory.control_points());
    int segment = 0;
    for (; next < data_.observations.size() &&
           data_.observations[next].landmark == static_cast<int>(l);
         ++next) {
      const AdjustmentObservation& observation = data_.observations[next];
      LinearisedResidual& residual = out->observations[next];
      residual.valid = false;
      const double time = data_.frame_time_s[static_cast<std::size_t>(observation.frame)] +
                          observation.u.y() * model.line_delay;
      const TrajectorySpline::Basis basis = trajectory.basis(time, segment);
      segment = basis.segment;
      ObservationModel::Result result;
      if (!model.evaluate(observation, trajectory.position(basis), trajectory.rate(basis), landmark,
                          nearness_of(state, observation.landmark), &result)) {
        if (!observation.used) continue;
        out->cost += robust_cost(kLostSquaredError, loss.pixel).cost;
        if (std::isinf(loss.pixel)) out->valid = false;
        continue;
      }
      const RobustCost robust = robust_cost(result.error.squaredNorm(), loss.pixel);
      const double root = std::sqrt(robust.weight);
      residual = {time, segment, true, root * result.error, root * result.J_angle};
      if (!observation.used) continue;
      out->cost += robust.cost;

      const Matrix2<double> Jt_angle = robust.weight * result.J_angle.transpose();
      const Matrix2<double> Jt_landmark = robust.weight * result.J_landmark.transpose();
      const Vector2<double> g_angle = Jt_angle * result.error;
      add_control_points(basis, Jt_angle * result.J_angle, &out->H);
      const Eigen::Matrix<double, kObservedCount, 2> H_ca =
          (Jt_angle * result.J_camera).transpose();
      const Matrix2<double> H_al = Jt_angle * result.J_landmark;
      for (int i = 0; i < 4; ++i) {
        const int point = segment + i;
        const double w = basis.weight[i];
        out->g.segment<2>(2 * point) += w * g_angle;
        out->H.border().block<kObservedCount, 2>(0, 2 * point) += w * H_ca;
        touched_buffer_[static_cast<std::size_t>(point)] += w * H_al;
        if (!is_touched_[static_cast<std::size_t>(point)]) {
          is_touched_[static_cast<std::size_t>(point)] = true;
          touched_now.push_back(point);
        }
      }
      const Eigen::Matrix<double, kObservedCount, 2> Jt_camera =
          robust.weight * result.J_camera.transpose();
      H_cc.noalias() += Jt_camera * result.J_camera;
      g_c.noalias() += Jt_camera * result.error;
      out->H_landmark[l] += Jt_landmark * result.J_landmark;
      out->g_landmark[l] += Jt_landmark * result.error;
      out->H_camera[l] += (Jt_landmark * result.J_camera).transpose();
      if (has_nearness) {
        nearness.add(basis, robust.weight, result.error, result.J_angle, result.J_landmark,
                     result.J_nearness, result.J_camera);
      }
    }
    std::sort(touched_now.begin(), touched_now.end());
    for (const int point : touched_now) {
      out->touched.push_back(point);
      out->H_touched.push_back(touched_buffer_[static_cast<std::size_t>(point)]);
      touched_buffer_[static_cast<std::size_t>(point)].setZero();
      is_touched_[static_cast<std::size_t>(point)] = false;
    }
    touched_now.clear();
    out->touched_begin.push_back(out->touched.size());
    if (has_nearness) nearness.end(l, out);
  }
  if (has_nearness) nearness.append_to(out);
  out->H.border().block<kObservedCount, kObservedCount>(0, camera_row) += H_cc;
  out->g.segment<kObservedCount>(camera_row) += g_c;
}

std::vector<Influence> Lineariser::influences(const AdjustmentState& state, const Linearisation& at,
                                              const GlobalRows& inverse) const {
  const ObservationModel model(state);
  const Eigen::Matrix<double, kGlobalCount, kObservedCount> of_camera =
      inverse.middleCols<kObservedCount>(inverse.cols() - kGlobalCount);
  const bool has_nearness = !state.nearness.empty();
  std::vector<Influence> all(data_.observations.size(), Influence::Zero());
  for (std::size_t i = 0; i < all.size();) {
    const int name = data_.observations[i].landmark;
    const auto l = static_cast<std::size_t>(name);
    const ObservationModel::Landmark landmark = model.turn(state.landmarks[l]);
    // The parts that the landmark's direction and nearness absorb.
    const auto absorbed = [&](std::size_t block) {
      Influence of = of_camera * at.H_camera[block];
      for (std::size_t j = at.touched_begin[block]; j < at.touched_begin[block + 1]; ++j) {
        of += inverse.middleCols<2>(2 * at.touched[j]) * at.H_touched[j];
      }
      return Influence(of * at.H_landmark[block].inverse());
    };
    const Influence of_landmark = absorbed(l);
    const GlobalVector of_nearness = has_nearness
                                         ? GlobalVector(absorbed(state.landmarks.size() + l).col(0))
                                         : GlobalVector(GlobalVector::Zero());
    for (; i < all.size() && data_.observations[i].landmark == name; ++i) {
      const AdjustmentObservation& observation = data_.observations[i];
      if (!observation.used) continue;
      const LinearisedResidual& residual = at.observations[i];
      const TrajectorySpline::Basis basis =
          state.trajectory.basis(residual.time_s, residual.segment);
      ObservationModel::Result result;
      if (!model.evaluate(observation, state.trajectory.position(basis),
                          state.trajectory.rate(basis), landmark, nearness_of(state, name),
                          &result)) {
        continue;
      }
      Influence of_angle = Influence::Zero();
      for (int k = 0; k < 4; ++k) {
        of_angle += basis.weight[k] * inverse.middleCols<2>(2 * (basis.segment + k));
      }
      all[i] = of_angle * result.J_angle.transpose() + of_camera * result.J_camera.transpose() -
               of_landmark * result.J_landmark.transpose();
      if (has_nearness) all[i] -= of_nearness * result.J_nearness_alone(at, l).transpose();
    }
  }
  return all;
}

void Lineariser::visit(const AdjustmentState& state, const Linearisation& at,
                       const std::function<void(const ObservationRow&)>& observation,
                       const std::function<void(const TelemetryRow&)>& telemetry) const {
  const ObservationModel model(state);
  const TrajectorySpline& trajectory = state.trajectory;
  for (std::size_t i = 0; i < data_.observations.size(); ++i) {
    const AdjustmentObservation& o = data_.observations[i];
    if (!o.used) continue;
    ObservationRow row;
    row.time_s = at.observations[i].time_s;
    row.basis = trajectory.basis(row.time_s, at.observations[i].segment);
    ObservationModel::Result result;
    if (!model.evaluate(o, trajectory.position(row.basis), trajectory.rate(row.basis),
                        model.turn(state.landmarks[static_cast<std::size_t>(o.landmark)]),
                        nearness_of(state, o.landmark), &result, &row)) {
      continue;
    }
    row.index = i;
    row.landmark = o.landmark;
    row.error = result.error;
    row.J_angle = result.J_angle;
    row.J_landmark = result.J_landmark;
    row.J_nearness.setZero();
    if (!state.nearness.empty())
      row.J_nearness = result.J_nearness_alone(at, static_cast<std::size_t>(o.landmark));
    row.J_camera = result.J_camera;
    observation(row);
  }
  const Vector2<double> scale(state.mechanics.pan_scale, state.mechanics.tilt_scale);
  for (std::size_t i = 0; i < data_.telemetry.size(); ++i) {
    const AdjustmentTelemetry& sample = data_.telemetry[i];
    if (!sample.used) continue;
    TelemetryRow row;
    row.index = i;
    row.time_s = at.telemetry[i].time_s;
    row.basis = trajectory.basis(row.time_s, at.telemetry[i].segment);
    row.error = at.telemetry[i].error;
    row.slope = scale.cwiseQuotient(sample.sigma);
    row.J = telemetry_jacobian(state.mechanics, sample, sample.time_s - data_.reference_s,
                               trajectory.position(row.basis).vector(),
                               trajectory.rate(row.basis).vector());
    row.sigma = sample.sigma;
    row.is_noise = sample.is_noise;
    telemetry(row);
  }
}

void Lineariser::add_telemetry(const AdjustmentState& state, const LossScales& loss,
                               Linearisation* out) {
  const TrajectorySpline& trajectory = state.trajectory;
  const int global_row = 2 * trajectory.control_points();
  const Vector2<double> scale(state.mechanics.pan_scale, state.mechanics.tilt_scale);
  NormalMatrix& H = out->H_telemetry;
  H.set_zero(trajectory.control_points());
  out->telemetry.resize(data_.telemetry.size());
  int segment = 0;
  for (std::size_t i = 0; i < data_.telemetry.size(); ++i) {
    const AdjustmentTelemetry& sample = data_.telemetry[i];
    const double since_reference = sample.time_s - data_.reference_s;
    const double time = sample.time_s - state.shift_s + state.drift * since_reference;
    const TrajectorySpline::Basis basis = trajectory.basis(time, segment);
    segment = basis.segment;
    const Vector2<double> angle = trajectory.position(basis).vector();
    const Vector2<double> rate = trajectory.rate(basis).vector();
    const Vector2<double> predicted = scale.cwiseProduct(angle);
    const Vector2<double> error(wrap_angle(sample.measured[0] - predicted[0]) / sample.sigma[0],
                                wrap_angle(sample.measured[1] - predicted[1]) / sample.sigma[1]);
    const RobustCost robust = robust_cost(error.squaredNorm(), loss.telemetry);
    const double root = std::sqrt(robust.weight);
    const Vector2<double> slope = scale.cwiseQuotient(sample.sigma);
    out->telemetry[i] = {time, segment, true, root * error,
                         Matrix2<double>((root * slope).asDiagonal())};
    if (!sample.used) continue;
    out->cost += robust.cost;

    const TelemetryJacobian J =
        telemetry_jacobian(state.mechanics, sample, since_reference, angle, rate);
    const Matrix2<double> J_squared =
        robust.weight * Matrix2<double>(slope.cwiseAbs2().asDiagonal());
    add_control_points(basis, J_squared, &H);
    const Eigen::Matrix<double, 4, 2> H_pa = robust.weight * J.transpose() * slope.asDiagonal();
    for (int k = 0; k < 4; ++k) {
      const int point = basis.segment + k;
      out->g.segment<2>(2 * point) += basis.weight[k] * robust.weight * slope.cwiseProduct(error);
      H.border().block<4, 2>(kObservedCount, 2 * point) += basis.weight[k] * H_pa;
    }
    H.border().block<4, 4>(kObservedCount, global_row + kObservedCount) +=
        robust.weight * J.transpose() * J;
    out->g.segment<4>(global_row + kObservedCount) += robust.weight * J.transpose() * error;
  }
  out->H += H;
}

void Lineariser::add_priors(const AdjustmentState& state, Linearisation* out) const {
  const AdjustmentState& mean = priors_.mean;
  // error = prior - state, J = d state / d step
  GlobalVector error;
  GlobalMatrix J = GlobalMatrix::Identity();
  error[index(Parameter::kFocalLength)] =
      std::log(mean.camera.focal_length / state.camera.focal_length);
  error[index(Parameter::kAspect)] = std::log(mean.camera.aspect / state.camera.aspect);
  // The prior is of the terms themselves, in units of the corner at the prior's focal length.
  const CornerDistortion<double> unit = corner_unit(mean.camera);
  const CameraColumn<double> along = by_zoom(state.physical_camera());
  const CornerDistortion<double> of_state =
      distortion_by_factor(state.camera.focal_length / mean.camera.focal_length);
  for (int i = 0; i < kDistortionCount; ++i) {
    const int k = camera_column::kDistortion + i;
    error[k] = mean.corner_distortion[i] - state.corner_distortion[i] * of_state[i];
    J(k, k) = of_state[i];
    J(k, camera_column::kFocalLength) = along[k] / unit[i];
  }
  error.segment<2>(index(Parameter::kCentreU)) =
      mean.camera.centre_offset() - state.camera.centre_offset();
  error[index(Parameter::kLineDelay)] = mean.readout_s - state.readout_s;
  const auto add_axis = [&](const Vector3<double>& axis, const Vector3<double>& prior, int first) {
    Matrix<double, 2, 3> J_change_axis;
    error.segment<2>(first) = -direction_minus<double>(axis, prior, &J_change_axis);
    J.block<2, 2>(first, first) = J_change_axis * tangent_basis(axis);
  };
  add_axis(state.mechanics.pan_axis, mean.mechanics.pan_axis, index(Parameter::kPanAxis0));
  add_axis(state.mechanics.tilt_axis, mean.mechanics.tilt_axis, index(Parameter::kTiltAxis0));
  error[index(Parameter::kPanScale)] = mean.mechanics.pan_scale - state.mechanics.pan_scale;
  error[index(Parameter::kTiltScale)] = mean.mechanics.tilt_scale - state.mechanics.tilt_scale;
  error[index(Parameter::kClockOffset)] = mean.shift_s - state.shift_s;
  error[kDrift] = mean.drift - state.drift;

  const GlobalMatrix JtW = J.transpose() * priors_.information.asDiagonal();
  out->H.border().rightCols<kGlobalCount>() += JtW * J;
  out->g.tail<kGlobalCount>() += JtW * error;
  out->cost += error.dot(priors_.information.cwiseProduct(error));
}

void Lineariser::fix_parameters(Linearisation* out) const {
  const auto first = out->H.rows() - kGlobalCount;
  for (int i = 0; i < kGlobalCount; ++i) {
    if (!fixed_[static_cast<std::size_t>(i)]) continue;
    const auto leave_out = [&](NormalMatrix* H) {
      H->border().row(i).setZero();
      H->border().col(first + i).setZero();
    };
    leave_out(&out->H);
    leave_out(&out->H_telemetry);
    out->H.border()(i, first + i) = 1;
    out->g[first + i] = 0;
    if (i >= kObservedCount) continue;
    for (auto& H_camera : out->H_camera) H_camera.row(i).setZero();
  }
}

}  // namespace alidade::internal
