#include "edge_app/self_calibration/checked_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <optional>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/calibration/axes_turn.h"
#include "core/calibration/centre_share.h"
#include "core/calibration/held_out.h"
#include "core/calibration/partial_inverse.h"
#include "edge_app/self_calibration/calibration_streams.h"
#include "edge_app/self_calibration/track_choice.h"

namespace alidade {
namespace {

using internal::CentreShare;

// common_s: the error common to all polls. It is in the known clock offset and in the new data
// alike. A free optical centre stays where it is known to be; the others' sigmas are then those
// with the centre held. Returns the centre's share of the known covariance.
CentreShare<kParameterCount> set_priors(const KnownCalibration& known, double inflation,
                                        double common_s, CalibrationOptions* adjustment) {
  const CentreShare<kParameterCount> centre =
      internal::centre_share<kParameterCount>(known.calibration.covariance);
  Calibration calibration = known.calibration;
  calibration.covariance = internal::with_centre_held(calibration.covariance, centre);
  adjustment->centre_offset_px = calibration.camera.centre_offset();
  adjustment->centre_sigma_px = 0;
  const auto prior = [&](double value, Parameter p) {
    return CalibrationPrior{value, inflation * parameter_sigma(calibration, p)};
  };
  adjustment->focal_length = prior(calibration.camera.focal_length, Parameter::kFocalLength);
  adjustment->radial_distortion =
      prior(calibration.camera.distortion.only_term(), Parameter::kRadialDistortion);
  adjustment->line_delay = prior(calibration.line_delay, Parameter::kLineDelay);
  if (known.has_clock_offset) {
    constexpr double kLeastOwn = 0.2;  // of the sigma
    const double sigma_s = parameter_sigma(calibration, Parameter::kClockOffset);
    const double own_s = std::sqrt(
        std::max(sigma_s * sigma_s - common_s * common_s, std::pow(kLeastOwn * sigma_s, 2)));
    adjustment->clock_offset = CalibrationPrior{calibration.clock_offset, inflation * own_s};
  }
  adjustment->pan_axis = calibration.mechanics.pan_axis;
  adjustment->tilt_axis = calibration.mechanics.tilt_axis;
  adjustment->axis_sigma_rad = 0;
  for (const Parameter p :
       {Parameter::kPanAxis0, Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1}) {
    adjustment->axis_sigma_rad =
        std::max(adjustment->axis_sigma_rad, inflation * parameter_sigma(calibration, p));
  }
  return centre;
}

// Multiplies the covariance by factor^2, except the priors' part, as a calibration that becomes one
// of many returns its priors (zoom_fit.h). False: the covariance is not positive.
bool grow_beyond_priors(const CalibrationOptions& made_with, double factor,
                        Calibration* calibration) {
  Eigen::VectorXd prior = Eigen::VectorXd::Zero(kParameterCount);  // information
  for (int i = 0; i < kParameterCount; ++i) {
    const double sigma = made_with.prior_sigma(static_cast<Parameter>(i)).value_or(0);
    if (sigma > 0) prior[i] = 1 / (sigma * sigma);
  }
  const Eigen::MatrixXd covariance = calibration->covariance;
  const std::vector<int> places = internal::free_places(covariance);
  Eigen::MatrixXd information = internal::inverse_over(covariance, places);
  if (information.size() == 0) return false;
  information /= factor * factor;
  information.diagonal() += (1 - 1 / (factor * factor)) * prior;
  const Eigen::MatrixXd grown = internal::inverse_over(information, places);
  if (grown.size() == 0) return false;
  calibration->covariance = grown;
  return true;
}

// Returns the held-out observations and leaves the others in *observations.
std::vector<CalibrationObservation> take_held_out(
    const std::vector<FrameStamp>& stamps, std::vector<CalibrationObservation>* observations) {
  std::unordered_map<std::int64_t, std::size_t> place_of;
  for (std::size_t i = 0; i < stamps.size(); ++i) place_of[stamps[i].frame] = i;
  const auto held = std::stable_partition(
      observations->begin(), observations->end(), [&](const CalibrationObservation& seen) {
        return !CalibrationSession::is_held_out(place_of[seen.frame]);
      });
  std::vector<CalibrationObservation> held_out(held, observations->end());
  observations->erase(held, observations->end());
  return held_out;
}

// Empty: not refused.
std::string refusal_of(const CalibrationQuality& quality, std::optional<double> held_out,
                       double unit, const CalibrationChecks& checks) {
  if (!held_out) return "no landmark was seen in a frame held out, so nothing tells how good it is";
  const double hold_out = *held_out;
  if (hold_out > checks.worst_hold_out * unit) {
    return fmt::format(
        "landmarks in frames that were held out lie {:.1f} sigmas from where they should",
        hold_out);
  }
  if (quality.pixel_sigma_ratio > checks.worst_pixel_ratio) {
    return fmt::format("the landmarks' residuals are {:.1f} times the tracker's noise",
                       quality.pixel_sigma_ratio);
  }
  if (quality.telemetry_sigma_ratio > checks.worst_telemetry_ratio) {
    return fmt::format(
        "telemetry is {:.1f} times as noisy as stated: is pan_tilt.angle_sigma_rad right?",
        quality.telemetry_sigma_ratio);
  }
  return "";
}

}  // namespace

CheckedCalibration calibrate_session(const CalibrationSession& session,
                                     const CheckedCalibrationOptions& options,
                                     const KnownCalibration* known) {
  CalibrationInput input;
  input.width = options.width;
  input.height = options.height;
  input.noise = options.noise;
  CalibrationOptions adjustment = options.adjustment;
  if (options.is_cancelled) {
    adjustment.progress = [&options](double, const char*) { return !options.is_cancelled(); };
  }
  const std::vector<FrameStamp> stamps = session.stamps();
  CheckedCalibration checked;
  add_frames(stamps, &input, &adjustment, &checked.remarks);
  add_telemetry(session.telemetry(), &input, &adjustment, &checked.remarks);
  // The error common to all polls is not averaged out by several calibrations. It is added to the
  // result instead.
  const double common_s = std::exchange(input.noise.telemetry_common_sigma_s, 0.0);
  CentreShare<kParameterCount> centre;
  if (known != nullptr) centre = set_priors(*known, options.prior_inflation, common_s, &adjustment);
  input.observations = choose_tracks(session.observations(), options.max_observations);
  const std::vector<CalibrationObservation> held_out = take_held_out(stamps, &input.observations);

  // A published calibration already contains what is known of the camera.
  KnownCameraCalibration calibrated =
      calibrate_knowing(input, adjustment, known == nullptr ? options.camera : KnownCamera());
  checked.result = std::move(calibrated.result);
  checked.remarks.insert(checked.remarks.end(), std::make_move_iterator(calibrated.remarks.begin()),
                         std::make_move_iterator(calibrated.remarks.end()));
  CalibrationResult& result = checked.result;
  if (!result.ok()) {
    checked.refusal = result.message;
    return checked;
  }
  checked.hold_out = held_out_error(held_out, session.frame_times(result), result);
  const double unit = std::max(1.0, result.quality.pixel_sigma_ratio);
  checked.refusal = refusal_of(result.quality, checked.hold_out, unit, options.checks);
  const double excess = checked.hold_out ? std::max(1.0, *checked.hold_out / unit) : 1;
  checked.adjustment = std::move(calibrated.options);
  checked.common_clock_sigma_s = common_s;
  if (!(checked.adjustment.centre_sigma_px > 0) ||
      !grow_beyond_priors(checked.adjustment, excess, &result.calibration)) {
    result.calibration.covariance *= excess * excess;
  }
  if (known != nullptr && centre.exists()) {
    centre.slope = internal::axes_turn(known->calibration.mechanics, result.calibration.mechanics) *
                   centre.slope;
  }
  result.calibration.covariance += centre.part();
  const int d = index(Parameter::kClockOffset);
  result.calibration.covariance(d, d) += common_s * common_s;
  return checked;
}

}  // namespace alidade
