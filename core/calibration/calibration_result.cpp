#include "core/calibration/calibration_result.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace alidade::internal {

namespace {

// How the knowledge of the clocks enters the calibration.
struct ClockShares {
  double image = 0;            // share of the drift that is the image clock's
  double image_rate = 0;       // relative error of the image clock's period, as estimated
  double rate_variance = 0;    // variance of image_rate, with the drift known
  double lever_s = 0;          // from the image clock's middle to where the drift has no effect
  double offset_prior = 0;     // weight of the clock offset's prior against the stamps
  double stamps_variance = 0;  // s^2
  bool line_delay_known = false;
};

ClockShares share_out(const CalibrationOptions& options, const RecordingClocks& clocks,
                      const PriorKnowledge& prior, const AdjustmentData& data,
                      const AdjustmentState& state) {
  ClockShares shares;
  const double image_variance = period_variance(clocks.image);
  const double telemetry_variance = period_variance(clocks.telemetry);
  // drift = telemetry's relative error of period - image's.
  const double total = image_variance + telemetry_variance;
  shares.image = total > 0 ? image_variance / total : 0;
  shares.image_rate = -shares.image * state.drift;
  shares.rate_variance = total > 0 ? image_variance * telemetry_variance / total : 0;
  shares.lever_s = data.reference_s - state.shift_s - clocks.image.middle_s;
  shares.stamps_variance = clocks.stamps_variance();
  if (options.clock_offset) {
    shares.offset_prior = shares.stamps_variance /
                          (shares.stamps_variance + std::pow(options.clock_offset->sigma, 2));
  }
  shares.line_delay_known = prior.fixed[static_cast<std::size_t>(index(Parameter::kLineDelay))];
  return shares;
}

Calibration physical(const CalibrationOptions& options, const ClockShares& shares,
                     const AdjustmentState& state) {
  Calibration c;
  c.camera = state.physical_camera();
  c.line_delay = state.line_delay() * (shares.line_delay_known ? 1 : 1 + shares.image_rate);
  c.mechanics = state.mechanics;
  c.clock_offset = state.shift_s - shares.lever_s * shares.image_rate;
  if (options.clock_offset) {
    c.clock_offset += shares.offset_prior * (options.clock_offset->value - c.clock_offset);
  }
  return c;
}

ParameterCovariance<double> physical_covariance(const Calibration& c, const ClockShares& shares,
                                                const AdjustmentState& state,
                                                const GlobalMatrix& covariance) {
  Eigen::Matrix<double, kParameterCount, kGlobalCount> J;
  J.setZero();
  for (int i = 0; i < kParameterCount; ++i) J(i, i) = 1;
  const int l = index(Parameter::kLineDelay);
  const int d = index(Parameter::kClockOffset);
  const ZoomQuantityMatrix<double> by_quantities = by_zoom_quantities(c.camera);
  for (int i = 0; i < kZoomQuantityCount; ++i) {
    for (int j = 0; j < kZoomQuantityCount; ++j) {
      J(index(kParameterOfQuantity[static_cast<std::size_t>(i)]),
        index(kParameterOfQuantity[static_cast<std::size_t>(j)])) = by_quantities(i, j);
    }
  }
  J(index(Parameter::kAspect), index(Parameter::kAspect)) = c.camera.aspect;
  if (!shares.line_delay_known) {
    J(l, l) = (1 + shares.image_rate) / c.camera.height;
    J(l, kDrift) = -shares.image * state.line_delay();
  }
  J(d, d) = 1 - shares.offset_prior;
  J(d, kDrift) = shares.lever_s * shares.image;
  ParameterCovariance<double> cov = J * covariance * J.transpose();
  ParameterCovariance<double> timing = ParameterCovariance<double>::Zero();
  timing(d, d) = shares.stamps_variance * (1 - shares.offset_prior) +
                 shares.lever_s * shares.lever_s * shares.rate_variance;
  if (!shares.line_delay_known) {
    timing(l, l) = state.line_delay() * state.line_delay() * shares.rate_variance;
    timing(l, d) = timing(d, l) = -shares.lever_s * state.line_delay() * shares.rate_variance;
  }
  cov += timing;
  return cov;
}

void fill_observations(const SelectedInput& selected, const Linearisation& at,
                       CalibrationResult* result) {
  const auto& observations = selected.data.observations;
  double error_sum = 0;
  int used = 0;
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const auto& o = observations[i];
    if (at.observations[i].valid) {
      result->observation_residuals.push_back(
          {selected.observation_index[i], at.observations[i].error * o.sigma, !o.used});
    }
    if (!o.used) continue;
    error_sum += at.observations[i].error.norm() * o.sigma;
    ++used;
  }
  result->quality.observations = used;
  result->quality.mean_reprojection_error_px = error_sum / std::max(1, used);
  result->exclusions.observations_outliers = static_cast<int>(observations.size()) - used;
}

void fill_telemetry(const SelectedInput& selected, const Linearisation& at,
                    CalibrationResult* result) {
  const auto& telemetry = selected.data.telemetry;
  int used = 0;
  for (std::size_t i = 0; i < telemetry.size(); ++i) {
    const auto& sample = telemetry[i];
    const auto& residual = at.telemetry[i];
    Vector2<double> sigma = sample.sigma;
    for (int axis = 0; axis < 2; ++axis) {
      if (!sample.is_noise[static_cast<std::size_t>(axis)]) {
        sigma[axis] = std::numeric_limits<double>::infinity();
      }
    }
    result->telemetry_residuals.push_back({selected.telemetry_index[i], residual.time_s,
                                           residual.error.cwiseProduct(sample.sigma), sigma,
                                           !sample.used});
    if (sample.used) ++used;
  }
  result->quality.telemetry = used;
  result->exclusions.telemetry_outliers = static_cast<int>(telemetry.size()) - used;
}

void fill_landmarks(const SelectedInput& selected, const Adjusted& adjusted,
                    CalibrationResult* result) {
  const AdjustmentState& state = adjusted.state;
  const Matrix3<double> R_base_from_anchor = R_base_from_camera(state.mechanics, state.anchor);
  auto& landmarks = result->landmarks;
  for (std::size_t i = 0; i < selected.landmark_name.size(); ++i) {
    CalibrationLandmark mark;
    mark.landmark = selected.landmark_name[i];
    mark.d_b = R_base_from_anchor * state.landmarks[i];
    const Matrix2<double> turn = tangent_basis(mark.d_b).transpose() * R_base_from_anchor *
                                 tangent_basis(state.landmarks[i]);
    Matrix2<double> covariance = adjusted.at.H_landmark[i].inverse();
    if (!state.nearness.empty()) {
      const Vector2<double>& c = adjusted.at.direction_by_nearness[i];
      covariance += c * c.transpose() / adjusted.at.H_landmark[state.landmarks.size() + i](0, 0);
    }
    mark.covariance = turn * covariance * turn.transpose();
    landmarks.push_back(mark);
  }
  for (const auto& o : selected.data.observations) {
    if (o.used) ++landmarks[static_cast<std::size_t>(o.landmark)].observations;
  }
  landmarks.erase(
      std::remove_if(landmarks.begin(), landmarks.end(),
                     [](const CalibrationLandmark& mark) { return mark.observations < 2; }),
      landmarks.end());
  result->quality.landmarks = static_cast<int>(landmarks.size());
}

void fill_frames(const CalibrationInput& input, const SelectedInput& selected,
                 const TrajectorySpline& trajectory, CalibrationResult* result) {
  std::vector<char> is_used(selected.frame_index.size(), 0);
  for (const auto& o : selected.data.observations) {
    if (o.used) is_used[static_cast<std::size_t>(o.frame)] = 1;
  }
  for (std::size_t i = 0; i < selected.frame_index.size(); ++i) {
    if (is_used[i] == 0) continue;
    const double time = selected.data.frame_time_s[i];
    const auto basis = trajectory.basis(time);
    result->frames.push_back({input.frames[selected.frame_index[i]].frame, time,
                              trajectory.position(basis), trajectory.rate(basis)});
  }
  result->quality.frames = static_cast<int>(result->frames.size());
}

}  // namespace

void fill_result(const CalibrationInput& input, const CalibrationOptions& options,
                 const RecordingClocks& clocks, const PriorKnowledge& prior,
                 const SelectedInput& selected, const Adjusted& adjusted,
                 CalibrationResult* result) {
  const AdjustmentState& state = adjusted.state;
  const ClockShares shares = share_out(options, clocks, prior, selected.data, state);
  result->calibration = physical(options, shares, state);
  result->calibration.covariance =
      physical_covariance(result->calibration, shares, state, adjusted.covariance);
  result->telemetry_error = adjusted.telemetry_error;
  result->nearness = adjusted.nearness;
  result->trajectory = state.trajectory;
  fill_observations(selected, adjusted.at, result);
  fill_telemetry(selected, adjusted.at, result);
  fill_landmarks(selected, adjusted, result);
  fill_frames(input, selected, state.trajectory, result);
}

}  // namespace alidade::internal
