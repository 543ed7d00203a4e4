#include "core/calibration/telemetry_departures.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/model/median.h"

namespace alidade::internal {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// A reading with less weight than this is an outlier: it drives no play.
constexpr double kLeastWeight = 0.1;
// The width at which play is looked for, in sigmas: what noise alone hardly crosses.
constexpr double kFirstWidth = 6;
// Errors of rounding go with the angle and the way to it, too: more must be gained.
constexpr double kLeastGainIfRounded = 12;

double scale_of(const AdjustmentState& state, int axis) {
  return axis == 0 ? state.mechanics.pan_scale : state.mechanics.tilt_scale;
}

// sqrt(robust weight) / sigma of a reading; 0 if it is not in use.
double root_information(const AdjustmentTelemetry& sample, const LinearisedResidual& residual,
                        double scale, int axis) {
  return sample.used ? residual.J_angle(axis, axis) / scale : 0;
}

double weight_of_reading(const AdjustmentTelemetry& sample, const LinearisedResidual& residual,
                         double scale, int axis) {
  if (!std::isfinite(sample.sigma[axis])) return 0;
  const double root = root_information(sample, residual, scale, axis) * sample.sigma[axis];
  return root * root;
}

// The readings' white noise over their sigma, from second differences, which a smooth error hardly
// has; at least 1.
double white_noise_ratio(const AdjustmentData& data, const AdjustmentState& state,
                         const Linearisation& at, int axis) {
  constexpr std::size_t kLeast = 8;
  const double kMedianOfNoise = 0.6745 * std::sqrt(6.0);
  std::vector<double> errors;
  for (std::size_t i = 0; i < data.telemetry.size(); ++i) {
    const auto& sample = data.telemetry[i];
    const double weight = weight_of_reading(sample, at.telemetry[i], scale_of(state, axis), axis);
    if (!sample.is_noise[static_cast<std::size_t>(axis)] || !(weight > 0)) continue;
    errors.push_back(at.telemetry[i].error[axis] / std::sqrt(weight));
  }
  if (errors.size() < kLeast) return 1;
  std::vector<double> bends;
  for (std::size_t i = 2; i < errors.size(); ++i) {
    bends.push_back(std::abs(errors[i] - 2 * errors[i - 1] + errors[i - 2]));
  }
  return std::max(1.0, median(std::move(bends)) / kMedianOfNoise);
}

// Uniform knots over the visited angles; none where there is hardly any movement.
AngleErrorCurve place_knots(double low, double high, double least_spacing) {
  constexpr int kIntervals = 60;
  constexpr double kCoarse_rad = 0.02;  // gears have periods of some degrees
  constexpr double kNearlyATurn = 0.98;
  AngleErrorCurve knots;
  if (high - low > kNearlyATurn * 2 * kPi) {
    knots.first_rad = -kPi;
    knots.count = AngleErrorCurve::kMaxKnots;
    knots.spacing_rad = 2 * kPi / knots.count;
    return knots;
  }
  const double finest = (high - low) / (AngleErrorCurve::kMaxKnots - 4);
  const double spacing =
      std::max({std::min((high - low) / kIntervals, kCoarse_rad), finest, least_spacing});
  const int count = spacing > 0 ? static_cast<int>(std::round((high - low) / spacing)) + 1 : 0;
  if (count < 4) return knots;
  // One more at either end: no later state of the trajectory leaves them.
  knots.count = count + 2;
  knots.spacing_rad = (high - low) / (count - 1);
  knots.first_rad = low - knots.spacing_rad;
  return knots;
}

}  // namespace

bool TelemetryDepartures::estimate(const AdjustmentData& data, const AdjustmentState& state,
                                   const Linearisation& at, bool choose, Adjustment* adjustment) {
  if (measured_.empty()) begin(data, state);
  find_columns(data, state, at);
  Normal normal;
  if (!eliminate(data, state, at, adjustment, &normal)) return false;
  MatrixXd sure = claim();
  if (choose) {
    limit_amplitudes(data, state, at);
    // One for both axes: a score that is weakened on one axis only is no longer that of S.
    const double certain = std::pow(
        std::max(white_noise_ratio(data, state, at, 0), white_noise_ratio(data, state, at, 1)), -2);
    fit_.priors =
        choose_departures(certain * normal.S, certain * normal.g, parts_, with_slopes(sure),
                          resolution_ > 0 ? kLeastGainIfRounded : kLeastGain);
    refine_departures(normal.S, normal.g, parts_, sure, &fit_.priors);
    add_possible_curves(normal, sure);
  }
  add_possible_play(&sure);
  add_possible_slopes(&sure);
  refine_departures(normal.S, normal.g, parts_, sure, &fit_.priors);
  fit_ = fit_departures(normal.S, normal.g, parts_, std::move(fit_.priors), sure);
  const VectorXd moved = subtracted_.size() == 0 ? fit_.mean : VectorXd(fit_.mean - subtracted_);
  change_ = std::sqrt(std::max(0.0, moved.dot(normal.S * moved)));
  covariance_ = normal.of_parameters * fit_.covariance * normal.of_parameters.transpose();
  return fit_.any() || accuracy_ > 0;
}

void TelemetryDepartures::begin(const AdjustmentData& data, const AdjustmentState& state) {
  Vector2<double> low = Vector2<double>::Constant(1e9);
  Vector2<double> high = -low;
  std::array<std::vector<double>, 2> sigmas;
  for (const auto& sample : data.telemetry) {
    measured_.push_back(sample.measured);
    sigma_.push_back(sample.sigma);
    const double time = sample.time_s - state.shift_s;
    if (time < state.trajectory.begin_s() || time > state.trajectory.end_s()) continue;
    const Vector2<double> angle = state.trajectory.position(time).vector();
    low = low.cwiseMin(angle);
    high = high.cwiseMax(angle);
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const double sigma = sample.sigma[static_cast<int>(axis)];
      if (sample.is_noise[axis] && std::isfinite(sigma)) sigmas[axis].push_back(sigma);
    }
  }
  Index next = 0;
  for (const int axis : {0, 1}) {
    const auto a = static_cast<std::size_t>(axis);
    typical_sigma_[axis] = sigmas[a].empty() ? resolution_ : median(std::move(sigmas[a]));
    knots_[a] = place_knots(low[axis], high[axis], resolution_);
    DeparturePart curve;
    curve.shape = DepartureShape::kCurve;
    curve.first = next;
    curve.count = knots_[a].count;
    curve.closed = knots_[a].fills_turn();
    curve.unit = typical_sigma_[axis];
    parts_.push_back(curve);
    curve.shape = DepartureShape::kRipple;
    for (int ripple = 0; ripple < kRipples; ++ripple) parts_.push_back(curve);
    next += curve.count;
    for (int kind = 0; kind < kKinds; ++kind) {
      DeparturePart play;
      play.first = next++;
      play.unit = typical_sigma_[axis];
      play.rival = static_cast<int>(play_part(axis, kKinds - 1 - kind));
      parts_.push_back(play);
    }
  }
}

void TelemetryDepartures::limit_amplitudes(const AdjustmentData& data, const AdjustmentState& state,
                                           const Linearisation& at) {
  constexpr double kMost = 5;  // standard deviations
  for (const int axis : {0, 1}) {
    double squares = 0;
    double count = 0;
    for (std::size_t i = 0; i < data.telemetry.size(); ++i) {
      const auto& sample = data.telemetry[i];
      const double weight = weight_of_reading(sample, at.telemetry[i], scale_of(state, axis), axis);
      if (!(weight > kLeastWeight)) continue;
      const double left = at.telemetry[i].error[axis] * sample.sigma[axis] / std::sqrt(weight);
      squares += std::pow(left + measured_[i][axis] - sample.measured[axis], 2);
      count += 1;
    }
    const double largest =
        std::max(typical_sigma_[axis], kMost * std::sqrt(squares / std::max(1.0, count)));
    for (std::size_t part = curve_part(axis); part < curve_part(axis + 1); ++part)
      parts_[part].largest = largest;
  }
}

void TelemetryDepartures::find_columns(const AdjustmentData& data, const AdjustmentState& state,
                                       const Linearisation& at) {
  columns_.assign(data.telemetry.size(), {});
  for (const int axis : {0, 1}) {
    const auto a = static_cast<std::size_t>(axis);
    for (std::size_t i = 0; i < columns_.size(); ++i) {
      const double angle = state.trajectory.position(at.telemetry[i].time_s).vector()[axis];
      columns_[i][a].curve = knots_[a].weights(angle);
    }
    find_play(data, state, at, axis);
  }
}

void TelemetryDepartures::find_play(const AdjustmentData& data, const AdjustmentState& state,
                                    const Linearisation& at, int axis) {
  constexpr double kStep_s = 5e-3;  // a turn-about between two readings is not missed by much
  constexpr double kMostSteps = 100;
  const auto a = static_cast<std::size_t>(axis);
  const double scale = scale_of(state, axis);
  const auto width = [&](int kind) {
    return is_present(play_part(axis, kind)) ? std::max(0.0, value(play_part(axis, kind)))
                                             : kFirstWidth * typical_sigma_[axis];
  };
  DraggedAngle camera(Play{width(0), 0, kKind[0]});
  DraggedAngle reading(Play{width(1), 0, kKind[1]});
  const double noise = typical_sigma_[axis] / scale;
  double from_s = at.telemetry.empty() ? 0 : at.telemetry.front().time_s;
  std::array<PlayColumn, kKinds> last;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    const LinearisedResidual& residual = at.telemetry[i];
    if (weight_of_reading(data.telemetry[i], residual, scale, axis) > kLeastWeight) {
      const double motor = (measured_[i][axis] - curve_at(columns_[i][a], axis)) / scale;
      const PlayedAngle dragged = camera.next(motor, noise);
      last[0] = {scale * (motor - dragged.angle), 0.5 * scale * dragged.direction,
                 scale * dragged.sigma_rad};
    }
    const int steps = static_cast<int>(
        std::clamp(std::ceil((residual.time_s - from_s) / kStep_s), 1.0, kMostSteps));
    for (int step = 1; step <= steps; ++step) {
      const double time = from_s + (residual.time_s - from_s) * step / steps;
      const double angle = state.trajectory.position(time).vector()[axis];
      const PlayedAngle dragged = reading.next(angle);
      last[1] = {scale * (dragged.angle - angle), -0.5 * scale * dragged.direction,
                 scale * dragged.sigma_rad};
    }
    from_s = residual.time_s;
    columns_[i][a].play = last;
  }
}

bool TelemetryDepartures::eliminate(const AdjustmentData& data, const AdjustmentState& state,
                                    const Linearisation& at, Adjustment* adjustment,
                                    Normal* out) const {
  constexpr int kPerReading = 4 + kKinds;
  const Index size = parts_.back().first + 1;
  const Index rows = at.H.rows();
  const Index first_global = rows - kGlobalCount;
  MatrixXd BWB = MatrixXd::Zero(size, size);
  MatrixXd H_xc = MatrixXd::Zero(rows, size);
  VectorXd BWr = VectorXd::Zero(size);
  for (std::size_t i = 0; i < data.telemetry.size(); ++i) {
    const AdjustmentTelemetry& sample = data.telemetry[i];
    const LinearisedResidual& residual = at.telemetry[i];
    const auto basis = state.trajectory.basis_in(residual.segment, residual.time_s);
    const TelemetryJacobian J = telemetry_jacobian(
        state.mechanics, sample, sample.time_s - data.reference_s,
        state.trajectory.position(basis).vector(), state.trajectory.rate(basis).vector());
    for (const int axis : {0, 1}) {
      const auto a = static_cast<std::size_t>(axis);
      const double scale = scale_of(state, axis);
      const double root = root_information(sample, residual, scale, axis);
      if (root == 0) continue;
      // Row of B, in units of the residual.
      const Columns& columns = columns_[i][a];
      std::array<Index, kPerReading> column{};
      Eigen::Matrix<double, kPerReading, 1> b;
      for (int k = 0; k < 4; ++k) {
        const auto n = static_cast<std::size_t>(k);
        column[n] = parts_[curve_part(axis)].first + columns.curve.knot[n];
        b[k] = root * columns.curve.value[k];
      }
      for (int kind = 0; kind < kKinds; ++kind) {
        const auto n = static_cast<std::size_t>(kind);
        column[4 + n] = parts_[play_part(axis, kind)].first;
        b[4 + kind] = root * columns.play[n].slope;
      }
      const double error = residual.error[axis];
      for (int k = 0; k < kPerReading; ++k) {
        if (b[k] == 0) continue;
        const Index to = column[static_cast<std::size_t>(k)];
        BWr[to] += b[k] * error;
        for (int j = 0; j < kPerReading; ++j)
          BWB(to, column[static_cast<std::size_t>(j)]) += b[k] * b[j];
        for (int point = 0; point < 4; ++point) {
          H_xc(2 * (basis.segment + point) + axis, to) +=
              b[k] * basis.weight[point] * residual.J_angle(axis, axis);
        }
        H_xc.col(to).tail<J.ColsAtCompileTime>() +=
            b[k] * root * sample.sigma[axis] * J.row(axis).transpose();
      }
    }
  }
  for (int i = 0; i < kGlobalCount; ++i) {
    if (fixed_[static_cast<std::size_t>(i)]) H_xc.row(first_global + i).setZero();
  }
  MatrixXd X;
  VectorXd step;
  if (!adjustment->solve_columns(at, H_xc, &X, &step)) return false;
  out->S = BWB - H_xc.transpose() * X;
  out->S = (0.5 * (out->S + out->S.transpose())).eval();
  out->g = BWr - H_xc.transpose() * step;
  if (subtracted_.size() > 0) out->g += out->S * subtracted_;
  out->of_parameters = X.bottomRows<kGlobalCount>();
  return true;
}

MatrixXd TelemetryDepartures::claim() const {
  const Index rows = parts_.back().first + 1;
  MatrixXd root(rows, 0);
  for (const int axis : {0, 1}) {
    const DeparturePart& curve = parts_[curve_part(axis)];
    if (!(accuracy_ > 0) || curve.count == 0) continue;
    const MatrixXd own =
        prior_root(curve, {accuracy_, static_cast<double>(curve.count - 1), 0}, rows);
    root.conservativeResize(Eigen::NoChange, root.cols() + own.cols());
    root.rightCols(own.cols()) = own;
  }
  return root;
}

void TelemetryDepartures::add_slope(int axis, double rise, MatrixXd* root) const {
  const DeparturePart& curve = parts_[curve_part(axis)];
  if (curve.count == 0 || curve.closed) return;
  root->conservativeResize(parts_.back().first + 1, root->cols() + 1);
  root->rightCols<1>().setZero();
  root->col(root->cols() - 1).segment(curve.first, curve.count) =
      VectorXd::LinSpaced(curve.count, -rise / 2, rise / 2);
}

MatrixXd TelemetryDepartures::with_slopes(const MatrixXd& sure) const {
  constexpr double kSteepest = 0.02;
  MatrixXd root = sure;
  for (const int axis : {0, 1})
    add_slope(axis, kSteepest * knots_[static_cast<std::size_t>(axis)].extent_rad(), &root);
  return root;
}

void TelemetryDepartures::add_possible_slopes(MatrixXd* sure) const {
  constexpr double kRise = 3;  // amplitudes; a sine of twice the range rises by as much
  for (const int axis : {0, 1}) {
    const std::size_t part = curve_part(axis);
    if (is_present(part)) add_slope(axis, kRise * fit_.priors[part].amplitude, sure);
  }
}

void TelemetryDepartures::add_possible_curves(const Normal& normal, const MatrixXd& sure) {
  double largest = 0;
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    if (parts_[i].shape != DepartureShape::kNumber)
      largest = std::max(largest, fit_.priors[i].amplitude);
  }
  if (!(largest > 0)) return;
  for (const int axis : {0, 1}) {
    const std::size_t part = curve_part(axis);
    bool ripples = false;
    for (int i = 1; i <= kRipples; ++i) ripples |= is_present(part + static_cast<std::size_t>(i));
    if (ripples || parts_[part].count == 0 || fit_.priors[part].amplitude >= largest) continue;
    fit_.priors[part] =
        possible_curve(normal.S, normal.g, parts_, fit_.priors, sure, part, largest);
  }
}

void TelemetryDepartures::add_possible_play(MatrixXd* sure) const {
  double largest = 0;
  for (const DeparturePrior& prior : fit_.priors) largest = std::max(largest, prior.amplitude);
  if (!(largest > 0)) return;
  for (const int axis : {0, 1}) {
    if (is_present(play_part(axis, 0)) || is_present(play_part(axis, 1))) continue;
    sure->conservativeResize(Eigen::NoChange, sure->cols() + 1);
    sure->rightCols<1>().setZero();
    (*sure)(parts_[play_part(axis, 0)].first, sure->cols() - 1) = largest;
  }
}

double TelemetryDepartures::curve_at(const Columns& columns, int axis) const {
  const DeparturePart& curve = parts_[curve_part(axis)];
  if (curve.count == 0 || fit_.mean.size() == 0) return 0;
  double sum = 0;
  for (int k = 0; k < 4; ++k) {
    sum += columns.curve.value[k] *
           fit_.mean[curve.first + columns.curve.knot[static_cast<std::size_t>(k)]];
  }
  return sum;
}

void TelemetryDepartures::subtract(const AdjustmentState& state, const Linearisation& at,
                                   AdjustmentData* data) {
  subtracted_ = fit_.mean;
  find_columns(*data, state, at);  // with the width that was found
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    AdjustmentTelemetry& sample = data->telemetry[i];
    for (const int axis : {0, 1}) {
      const Columns& columns = columns_[i][static_cast<std::size_t>(axis)];
      double error = curve_at(columns, axis);
      double unsure = 0;
      for (int kind = 0; kind < kKinds; ++kind) {
        const PlayColumn& play = columns.play[static_cast<std::size_t>(kind)];
        if (is_present(play_part(axis, kind))) {
          error += play.ahead;
          unsure = play.unsure;
        } else {
          error += play.slope * value(play_part(axis, kind));
        }
      }
      sample.measured[axis] = measured_[i][axis] - error;
      sample.sigma[axis] = std::hypot(sigma_[i][axis], unsure);
    }
  }
}

void TelemetryDepartures::scale_noise(double ratio) {
  for (Vector2<double>& sigma : sigma_) sigma *= ratio;
}

TelemetryError TelemetryDepartures::error() const {
  TelemetryError out;
  if (fit_.priors.empty()) return out;
  const VectorXd sigma = fit_.covariance.diagonal().cwiseMax(0).cwiseSqrt();
  for (const int axis : {0, 1}) {
    const DeparturePart& part = parts_[curve_part(axis)];
    AngleErrorCurve& curve = axis == 0 ? out.pan : out.tilt;
    double variance = accuracy_ * accuracy_;
    for (std::size_t i = curve_part(axis); i < play_part(axis, 0); ++i) {
      const DeparturePrior& prior = fit_.priors[i];
      if (!(prior.amplitude > 0)) continue;
      if (curve.count == 0) curve = knots_[static_cast<std::size_t>(axis)];
      // A sine is unlike itself after a sixth of its period.
      const double length =
          curve.spacing_rad *
          (parts_[i].shape == DepartureShape::kRipple ? prior.length / 6 : prior.length);
      curve.length_rad = curve.length_rad > 0 ? std::min(curve.length_rad, length) : length;
      variance += prior.amplitude * prior.amplitude;
    }
    if (curve.count > 0) {
      curve.unseen_sigma_rad = std::sqrt(variance);
      for (Index k = 0; k < part.count; ++k) {
        const auto n = static_cast<std::size_t>(k);
        curve.values[n] = fit_.mean[part.first + k];
        curve.sigmas[n] = sigma[part.first + k];
      }
      // Beyond its ends a curve fades no more steeply than its inverse allows (validate()).
      constexpr double kLengthsOfEnds = 5;
      const double ends =
          std::max(std::abs(curve.values[0]),
                   std::abs(curve.values[static_cast<std::size_t>(part.count - 1)]));
      if (curve.length_rad > 0)
        curve.length_rad = std::max(curve.length_rad, kLengthsOfEnds * ends);
    }
    Play& play = axis == 0 ? out.pan_play : out.tilt_play;
    for (int kind = 0; kind < kKinds; ++kind) {
      if (!is_present(play_part(axis, kind))) continue;
      play = {std::max(0.0, value(play_part(axis, kind))),
              sigma[parts_[play_part(axis, kind)].first], kKind[static_cast<std::size_t>(kind)]};
    }
  }
  return out;
}

}  // namespace alidade::internal
