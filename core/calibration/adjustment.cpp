#include "core/calibration/adjustment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace alidade::internal {

namespace {

using CameraJacobian = Eigen::Matrix<double, 2, kCameraCount>;

// Row velocity of the image beyond which a landmark meets the read-out in no definite row.
constexpr double kMaxRowSlope = 0.9;

struct ObservationModel {
  const Camera<double> camera;
  const Mechanics<double>& mechanics;
  const double line_delay;
  const double distortion_unit;  // k = distortion * unit
  Matrix3<double> R_base_from_anchor;
  Matrix<double, 3, 4> J_xi_axes_anchor;

  explicit ObservationModel(const AdjustmentState& state)
      : camera(state.physical_camera()),
        mechanics(state.mechanics),
        line_delay(state.line_delay()),
        distortion_unit(std::pow(state.camera.focal_length / state.half_diagonal(), 2)) {
    J_xi_axes_anchor.setZero();
    R_base_from_anchor =
        R_base_from_camera(state.mechanics, state.anchor, nullptr, &J_xi_axes_anchor);
  }

  struct Landmark {
    Vector3<double> d_b;
    Matrix<double, 3, 2> J_db_landmark;
    Matrix<double, 3, 4> J_db_axes;
  };
  [[nodiscard]] Landmark turn(const Vector3<double>& d_anchor) const {
    return {R_base_from_anchor * d_anchor, R_base_from_anchor * tangent_basis(d_anchor),
            -R_base_from_anchor * (skew(d_anchor) * J_xi_axes_anchor)};
  }

  struct Result {
    Vector2<double> error;
    Matrix2<double> J_angle;  // of the projection, like the following
    Matrix2<double> J_landmark;
    CameraJacobian J_camera;
  };

  // In units of sigma.
  [[nodiscard]] bool evaluate(const AdjustmentObservation& observation,
                              const PanTilt<double>& angle, const PanTilt<double>& rate,
                              const Landmark& landmark, Result* out) const {
    Matrix<double, 3, 2> J_xi_angle;
    Matrix<double, 3, 4> J_xi_axes;
    const Matrix3<double> R = R_base_from_camera(mechanics, angle, &J_xi_angle, &J_xi_axes);
    const Vector3<double> d_c = R.transpose() * landmark.d_b;
    Vector2<double> u;
    Matrix<double, 2, 3> J_u_dc;
    Matrix<double, 2, 3> J_u_camera;
    if (project(camera, d_c, &u, &J_u_dc, &J_u_camera) != ProjectionStatus::kOk) return false;
    const Matrix<double, 2, 3> J_u_xi = J_u_dc * skew(d_c);
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
    CameraJacobian J;
    J.col(0) =
        camera.focal_length * J_u_camera.col(0) + 2 * camera.radial_distortion * J_u_camera.col(2);
    J.col(1) = camera.aspect * J_u_camera.col(1);
    J.col(2) = distortion_unit * J_u_camera.col(2);
    J.col(3) = J_u_time * (observation.u.y() / camera.height);
    J.rightCols<4>() = J_u_xi * J_xi_axes + J_u_db * landmark.J_db_axes;
    out->J_camera = whiten * J;
    return true;
  }
};

struct RobustCost {
  double cost;
  double weight;
};

RobustCost robust_cost(double squared_error, double scale) {
  if (std::isinf(scale)) return {squared_error, 1};
  const double c = scale * scale;
  return {c * std::log1p(squared_error / c), 1 / (1 + squared_error / c)};
}

// What an observation without a projection costs: it must not pay to lose one.
constexpr double kLostSquaredError = 1e10;

// L^-1 in place of L, a lower triangle; a third of the work of solving for the identity.
void invert_lower(Eigen::Ref<Eigen::MatrixXd> L) {
  const auto size = L.rows();
  if (size <= 32) {
    const Eigen::MatrixXd inverse =
        L.triangularView<Eigen::Lower>().solve(Eigen::MatrixXd::Identity(size, size));
    L.triangularView<Eigen::Lower>() = inverse;
    return;
  }
  const auto half = size / 2;
  auto below = L.bottomLeftCorner(size - half, half);
  L.bottomRightCorner(size - half, size - half).triangularView<Eigen::Lower>().solveInPlace(below);
  L.topLeftCorner(half, half).triangularView<Eigen::Lower>().solveInPlace<Eigen::OnTheRight>(below);
  below *= -1;
  invert_lower(L.topLeftCorner(half, half));
  invert_lower(L.bottomRightCorner(size - half, size - half));
}

// H's block of four control points: J^T J (x) w w^T, lower triangle.
void add_control_points(const TrajectorySpline::Basis& basis, const Matrix2<double>& J_squared,
                        Eigen::MatrixXd* H) {
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j <= i; ++j) {
      H->block<2, 2>(2 * (basis.segment + i), 2 * (basis.segment + j)) +=
          basis.weight[i] * basis.weight[j] * J_squared;
    }
  }
}

}  // namespace

double AdjustmentState::half_diagonal() const {
  return 0.5 * std::hypot(camera.width, camera.height);
}

Camera<double> AdjustmentState::physical_camera() const {
  Camera<double> physical = camera;
  physical.radial_distortion = distortion * std::pow(camera.focal_length / half_diagonal(), 2);
  return physical;
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
  state->distortion += global[index(Parameter::kRadialDistortion)];
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
  for (std::size_t i = 0; i < x_landmark.size(); ++i) {
    state->landmarks[i] = direction_plus<double>(state->landmarks[i], x_landmark[i]).normalized();
  }
  mechanics.pan_axis.normalize();
  mechanics.tilt_axis.normalize();
}

void Adjustment::linearise(const AdjustmentState& state, const LossScales& loss,
                           Linearisation* out) {
  const int size = 2 * state.trajectory.control_points() + kGlobalCount;
  out->cost = 0;
  out->valid = true;
  out->H.setZero(size, size);
  out->g.setZero(size);
  add_observations(state, loss, out);
  add_telemetry(state, loss, out);
  add_priors(state, out);
  fix_parameters(out);
}

void Adjustment::add_observations(const AdjustmentState& state, const LossScales& loss,
                                  Linearisation* out) {
  const ObservationModel model(state);
  const TrajectorySpline& trajectory = state.trajectory;
  const int camera_row = 2 * trajectory.control_points();
  const std::size_t landmarks = state.landmarks.size();
  out->observations.resize(data_.observations.size());
  out->H_landmark.assign(landmarks, Matrix2<double>::Zero());
  out->g_landmark.assign(landmarks, Vector2<double>::Zero());
  out->H_camera.assign(landmarks, Eigen::Matrix<double, kCameraCount, 2>::Zero());
  out->touched.clear();
  out->H_touched.clear();
  out->touched_begin.assign(1, 0);
  touched_buffer_.assign(static_cast<std::size_t>(trajectory.control_points()),
                         Matrix2<double>::Zero());
  is_touched_.assign(static_cast<std::size_t>(trajectory.control_points()), false);

  Eigen::Matrix<double, kCameraCount, kCameraCount> H_cc;
  H_cc.setZero();
  Eigen::Matrix<double, kCameraCount, 1> g_c;
  g_c.setZero();
  std::vector<int> touched_now;
  std::size_t next = 0;
  for (std::size_t l = 0; l < landmarks; ++l) {
    const ObservationModel::Landmark landmark = model.turn(state.landmarks[l]);
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
                          &result)) {
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
      const Eigen::Matrix<double, kCameraCount, 2> H_ca = (Jt_angle * result.J_camera).transpose();
      const Matrix2<double> H_al = Jt_angle * result.J_landmark;
      for (int i = 0; i < 4; ++i) {
        const int point = segment + i;
        const double w = basis.weight[i];
        out->g.segment<2>(2 * point) += w * g_angle;
        out->H.block<kCameraCount, 2>(camera_row, 2 * point) += w * H_ca;
        touched_buffer_[static_cast<std::size_t>(point)] += w * H_al;
        if (!is_touched_[static_cast<std::size_t>(point)]) {
          is_touched_[static_cast<std::size_t>(point)] = true;
          touched_now.push_back(point);
        }
      }
      const Eigen::Matrix<double, kCameraCount, 2> Jt_camera =
          robust.weight * result.J_camera.transpose();
      H_cc.noalias() += Jt_camera * result.J_camera;
      g_c.noalias() += Jt_camera * result.error;
      out->H_landmark[l] += Jt_landmark * result.J_landmark;
      out->g_landmark[l] += Jt_landmark * result.error;
      out->H_camera[l] += (Jt_landmark * result.J_camera).transpose();
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
  }
  out->H.block<kCameraCount, kCameraCount>(camera_row, camera_row) += H_cc;
  out->g.segment<kCameraCount>(camera_row) += g_c;
}

void Adjustment::add_telemetry(const AdjustmentState& state, const LossScales& loss,
                               Linearisation* out) {
  const TrajectorySpline& trajectory = state.trajectory;
  const int global_row = 2 * trajectory.control_points();
  const Vector2<double> scale(state.mechanics.pan_scale, state.mechanics.tilt_scale);
  Eigen::MatrixXd& H = out->H_telemetry;
  H.setZero(out->H.rows(), out->H.cols());
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

    // Columns pan scale, tilt scale, shift, drift.
    Eigen::Matrix<double, 2, 4> J;
    J << angle[0], 0, -scale[0] * rate[0], scale[0] * rate[0] * since_reference,  //
        0, angle[1], -scale[1] * rate[1], scale[1] * rate[1] * since_reference;
    J = (sample.sigma.cwiseInverse().asDiagonal() * J).eval();
    const Matrix2<double> J_squared =
        robust.weight * Matrix2<double>(slope.cwiseAbs2().asDiagonal());
    add_control_points(basis, J_squared, &H);
    const Eigen::Matrix<double, 4, 2> H_pa = robust.weight * J.transpose() * slope.asDiagonal();
    for (int k = 0; k < 4; ++k) {
      const int point = basis.segment + k;
      out->g.segment<2>(2 * point) += basis.weight[k] * robust.weight * slope.cwiseProduct(error);
      H.block<4, 2>(global_row + kCameraCount, 2 * point) += basis.weight[k] * H_pa;
    }
    H.block<4, 4>(global_row + kCameraCount, global_row + kCameraCount) +=
        robust.weight * J.transpose() * J;
    out->g.segment<4>(global_row + kCameraCount) += robust.weight * J.transpose() * error;
  }
  out->H += H;
}

void Adjustment::add_priors(const AdjustmentState& state, Linearisation* out) const {
  const AdjustmentState& mean = priors_.mean;
  // error = prior - state, J = d state / d step
  GlobalVector error;
  GlobalMatrix J = GlobalMatrix::Identity();
  error[index(Parameter::kFocalLength)] =
      std::log(mean.camera.focal_length / state.camera.focal_length);
  error[index(Parameter::kAspect)] = std::log(mean.camera.aspect / state.camera.aspect);
  // Of k itself, not of its scaled form.
  const double f_ratio = state.camera.focal_length / mean.camera.focal_length;
  error[index(Parameter::kRadialDistortion)] =
      mean.distortion - state.distortion * f_ratio * f_ratio;
  J(index(Parameter::kRadialDistortion), index(Parameter::kRadialDistortion)) = f_ratio * f_ratio;
  J(index(Parameter::kRadialDistortion), index(Parameter::kFocalLength)) =
      2 * state.distortion * f_ratio * f_ratio;
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
  out->H.bottomRightCorner<kGlobalCount, kGlobalCount>() += JtW * J;
  out->g.tail<kGlobalCount>() += JtW * error;
  out->cost += error.dot(priors_.information.cwiseProduct(error));
}

void Adjustment::fix_parameters(Linearisation* out) const {
  const auto first = out->H.rows() - kGlobalCount;
  for (int i = 0; i < kGlobalCount; ++i) {
    if (!fixed_[static_cast<std::size_t>(i)]) continue;
    out->H.row(first + i).setZero();
    out->H.col(first + i).setZero();
    out->H(first + i, first + i) = 1;
    out->H_telemetry.row(first + i).setZero();
    out->H_telemetry.col(first + i).setZero();
    out->g[first + i] = 0;
    if (i >= kCameraCount) continue;
    for (auto& H_camera : out->H_camera) H_camera.row(i).setZero();
  }
}

bool Adjustment::reduce(const Linearisation& in, double damping) {
  reduced_ = in.H;
  reduced_.diagonal() *= 1 + damping;
  reduced_g_ = in.g;
  const auto camera_row = in.H.rows() - kGlobalCount;
  std::vector<Matrix2<double>> Y;
  for (std::size_t l = 0; l < in.H_landmark.size(); ++l) {
    if (in.touched_begin[l] == in.touched_begin[l + 1]) continue;  // no observation is in use
    Matrix2<double> V = in.H_landmark[l];
    V.diagonal() *= 1 + damping;
    const Eigen::LLT<Matrix2<double>> llt(V);
    if (llt.info() != Eigen::Success) return false;
    const Matrix2<double> root_inverse = llt.matrixL().solve(Matrix2<double>::Identity());
    const Vector2<double> y_g = root_inverse * in.g_landmark[l];
    const Eigen::Matrix<double, kCameraCount, 2> Y_c = in.H_camera[l] * root_inverse.transpose();
    const std::size_t begin = in.touched_begin[l];
    const std::size_t end = in.touched_begin[l + 1];
    Y.resize(end - begin);
    for (std::size_t i = begin; i < end; ++i) {
      Matrix2<double>& Y_i = Y[i - begin];
      Y_i = in.H_touched[i] * root_inverse.transpose();
      const int row = 2 * in.touched[i];
      for (std::size_t j = begin; j <= i; ++j) {
        reduced_.block<2, 2>(row, 2 * in.touched[j]) -= Y_i * Y[j - begin].transpose();
      }
      reduced_.block<kCameraCount, 2>(camera_row, row) -= Y_c * Y_i.transpose();
      reduced_g_.segment<2>(row) -= Y_i * y_g;
    }
    reduced_.block<kCameraCount, kCameraCount>(camera_row, camera_row) -= Y_c * Y_c.transpose();
    reduced_g_.segment<kCameraCount>(camera_row) -= Y_c * y_g;
  }
  return true;
}

bool Adjustment::solve(const Linearisation& in, double damping, Eigen::VectorXd* x,
                       std::vector<Vector2<double>>* x_landmark) {
  if (!reduce(in, damping)) return false;
  // Unit diagonal: units of the parameters play no part.
  const Eigen::VectorXd scale = reduced_.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  reduced_ = scale.asDiagonal() * reduced_ * scale.asDiagonal();
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> llt(reduced_);
  if (llt.info() != Eigen::Success) return false;
  *x = scale.cwiseProduct(llt.solve(scale.cwiseProduct(reduced_g_)));
  if (!x->allFinite()) return false;

  const auto camera_row = in.H.rows() - kGlobalCount;
  x_landmark->resize(in.H_landmark.size());
  for (std::size_t l = 0; l < in.H_landmark.size(); ++l) {
    Vector2<double> g = in.g_landmark[l];
    for (std::size_t i = in.touched_begin[l]; i < in.touched_begin[l + 1]; ++i) {
      g -= in.H_touched[i].transpose() * x->segment<2>(2 * in.touched[i]);
    }
    if (in.touched_begin[l] == in.touched_begin[l + 1]) {
      (*x_landmark)[l].setZero();
      continue;
    }
    g -= in.H_camera[l].transpose() * x->segment<kCameraCount>(camera_row);
    Matrix2<double> V = in.H_landmark[l];
    V.diagonal() *= 1 + damping;
    (*x_landmark)[l] = V.llt().solve(g);
  }
  return true;
}

bool Adjustment::minimise(const LossScales& loss, int max_steps, double tolerance,
                          AdjustmentState* state, Linearisation* at) {
  constexpr double kMaxDamping = 1e8;
  constexpr double kLeastDamping = 1e-10;
  linearise(*state, loss, at);
  if (!at->valid) return false;
  Linearisation next;
  Eigen::VectorXd x;
  std::vector<Vector2<double>> x_landmark;
  for (int step = 0; step < max_steps;) {
    bool accepted = false;
    double promised = 0;
    if (solve(*at, damping_, &x, &x_landmark)) {
      promised = x.dot(at->g);
      for (std::size_t l = 0; l < x_landmark.size(); ++l) {
        promised += x_landmark[l].dot(at->g_landmark[l]);
      }
      AdjustmentState candidate = *state;
      apply_step(x, x_landmark, &candidate);
      linearise(candidate, loss, &next);
      ++steps_taken_;
      ++step;
      // A step below the rounding of the cost is as good as its promise.
      accepted = next.valid && next.cost <= at->cost + 1e-9 * at->cost;
      if (accepted) {
        *state = std::move(candidate);
        std::swap(*at, next);
      }
    }
    if (accepted) {
      if (promised < tolerance) return true;
      damping_ = std::max(damping_ / 10, kLeastDamping);
    } else {
      damping_ = std::max(damping_ * 10, 1e-5);
      if (damping_ > kMaxDamping) {
        damping_ = kLeastDamping;
        return false;
      }
    }
  }
  return false;
}

bool Adjustment::covariance(const Linearisation& in, GlobalMatrix* covariance,
                            double* telemetry_unknowns) {
  // A pivot of the scaled matrix is 1 minus the share of a parameter that the others explain.
  constexpr double kMinPivot = 1e-13;
  if (!reduce(in, 0)) return false;
  const auto size = reduced_.rows();
  const Eigen::VectorXd scale = reduced_.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  reduced_ = scale.asDiagonal() * reduced_ * scale.asDiagonal();
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>, Eigen::Lower> llt(reduced_);
  if (llt.info() != Eigen::Success) return false;
  if (reduced_.diagonal().cwiseAbs2().minCoeff() < kMinPivot) return false;
  // H^-1 = S (L^-1)^T L^-1 S; only the band of control points that share a segment and the parameters are asked for.
  invert_lower(reduced_);
  const auto root = [&](Eigen::Index i, Eigen::Index from) {
    return reduced_.col(i).tail(size - from);
  };
  const auto inverse = [&](Eigen::Index i, Eigen::Index j) {
    const auto from = std::max(i, j);
    return scale[i] * scale[j] * root(i, from).dot(root(j, from));
  };
  const auto first_global = size - kGlobalCount;
  for (int i = 0; i < kGlobalCount; ++i) {
    for (int j = 0; j < kGlobalCount; ++j) {
      (*covariance)(i, j) = inverse(first_global + i, first_global + j);
    }
  }
  for (int i = 0; i < kGlobalCount; ++i) {
    if (!fixed_[static_cast<std::size_t>(i)]) continue;
    covariance->row(i).setZero();
    covariance->col(i).setZero();
  }
  *telemetry_unknowns = 0;
  for (Eigen::Index j = 0; j < size; ++j) {
    for (Eigen::Index i = j; i < size; ++i) {
      const double h = in.H_telemetry(i, j);
      if (h == 0) continue;
      *telemetry_unknowns += (i == j ? 1 : 2) * h * inverse(i, j);
    }
  }
  return true;
}

}  // namespace alidade::internal
