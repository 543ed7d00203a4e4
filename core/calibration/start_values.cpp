#include "core/calibration/start_values.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "core/calibration/rounded_telemetry.h"
#include "core/calibration/sufficiency.h"
#include "core/calibration/telemetry_fit.h"
#include "core/model/median.h"
#include "core/model/recording_needs.h"

namespace alidade::internal {

namespace {

// Telemetry is used this far beyond the first and last frame, to hold the spline's ends.
constexpr double kMargin_s = 0.25;

// Leaves out frames outside the telemetry's time span, their observations, and landmarks then seen
// once.
void leave_out_frames_without_telemetry(double shift_s, SelectedInput* selected,
                                        CalibrationExclusions* excluded) {
  AdjustmentData& data = selected->data;
  const double begin = data.telemetry.front().time_s;
  const double end = data.telemetry.back().time_s;
  const auto outside = [&](double time) { return time + shift_s < begin || time + shift_s > end; };
  for (const double time : data.frame_time_s) {
    if (outside(time)) ++excluded->frames_without_telemetry;
  }
  if (excluded->frames_without_telemetry == 0) return;
  std::vector<AdjustmentObservation> inside;
  std::vector<std::size_t> indices;
  std::vector<std::int64_t> names;
  for (std::size_t i = 0; i < data.observations.size();) {
    const int landmark = data.observations[i].landmark;
    std::vector<std::size_t> kept;
    for (; i < data.observations.size() && data.observations[i].landmark == landmark; ++i) {
      const auto frame = static_cast<std::size_t>(data.observations[i].frame);
      if (!outside(data.frame_time_s[frame])) kept.push_back(i);
    }
    if (kept.size() == 1) ++excluded->observations_of_single_landmarks;
    if (kept.size() < 2) continue;
    for (const std::size_t j : kept) {
      inside.push_back(data.observations[j]);
      inside.back().landmark = static_cast<int>(names.size());
      indices.push_back(selected->observation_index[j]);
    }
    names.push_back(selected->landmark_name[static_cast<std::size_t>(landmark)]);
  }
  data.observations = std::move(inside);
  selected->observation_index = std::move(indices);
  selected->landmark_name = std::move(names);
}

struct TimeSpan {
  double begin_s = std::numeric_limits<double>::infinity();
  double end_s = -std::numeric_limits<double>::infinity();
};

// Of the observed frames, on the image clock.
TimeSpan observed_span(const AdjustmentData& data) {
  TimeSpan span;
  for (const auto& o : data.observations) {
    const double time = data.frame_time_s[static_cast<std::size_t>(o.frame)];
    span.begin_s = std::min(span.begin_s, time);
    span.end_s = std::max(span.end_s, time);
  }
  return span;
}

void leave_out_telemetry_outside(const TimeSpan& span, double shift_s, SelectedInput* selected,
                                 CalibrationExclusions* excluded) {
  AdjustmentData& data = selected->data;
  std::vector<AdjustmentTelemetry> samples;
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < data.telemetry.size(); ++i) {
    const double time = data.telemetry[i].time_s - shift_s;
    if (time < span.begin_s || time > span.end_s) continue;
    samples.push_back(data.telemetry[i]);
    indices.push_back(selected->telemetry_index[i]);
  }
  excluded->telemetry_unused = static_cast<int>(data.telemetry.size() - samples.size());
  data.telemetry = std::move(samples);
  selected->telemetry_index = std::move(indices);
}

}  // namespace

StageStatus find_motion(const CalibrationInput& input, const CalibrationOptions& options,
                        const RecordingClocks& clocks, SelectedInput* selected,
                        MotionStart* motion) {
  auto& telemetry = selected->data.telemetry;
  unwrap(&telemetry);
  // Here the two time spans need only overlap. Frames without telemetry are left out once d is
  // known.
  const double begin = telemetry.front().time_s;
  const double end = telemetry.back().time_s;
  double telemetry_sigma = 0;
  const double spacing_s =
      std::max(0.25, 5 * (end - begin) / static_cast<double>(telemetry.size()));
  const auto smooth = fit_telemetry(telemetry, 0, begin, end, spacing_s, &telemetry_sigma);
  if (!smooth) {
    return {CalibrationStatus::kBadInput, "the telemetry cannot be fitted by a smooth motion"};
  }
  TelemetryAngleNoise& noise = motion->noise;
  noise.resolution_rad = angle_resolution(telemetry);
  const double rounding_variance = noise.resolution_rad * noise.resolution_rad / 12;
  const double stated = input.noise.pan_tilt_sigma_rad.value_or(0);
  noise.white_sigma_rad =
      stated > 0 ? stated
                 : std::sqrt(std::max(0.0, telemetry_sigma * telemetry_sigma - rounding_variance));
  set_telemetry_sigma(noise.white_sigma_rad, noise.resolution_rad,
                      clocks.telemetry.steady ? 0 : clocks.telemetry.stamp_sigma_s, *smooth,
                      &telemetry);

  const auto image = image_motion(selected->data, kLandmarkStep_s);
  const double centre = options.clock_offset ? options.clock_offset->value : 0;
  double range = options.clock_offset_search_s;
  for (;; range *= 2) {
    motion->match = match_motion(image, *smooth, centre, range);
    if (!motion->match.at_edge || range > end - begin) break;
  }
  StageStatus status;
  status.status = check_motion(image, *smooth, motion->match, input, &status.message);
  return status;
}

StageStatus start_values(const CalibrationInput& input, const CalibrationOptions& options,
                         const RecordingClocks& clocks, const MotionMatch& match,
                         SelectedInput* selected, CalibrationExclusions* excluded,
                         StartValues* start) {
  start->prior = prior_knowledge(input.width, input.height, options, clocks, match.focal_length);
  const AdjustmentState& mean = start->prior.priors.mean;
  AdjustmentState& state = start->state;
  state.camera = {match.focal_length, mean.camera.aspect, {0}, input.width, input.height};
  if (options.focal_length && options.focal_length->sigma == 0) {
    state.camera.focal_length = mean.camera.focal_length;
  }
  state.camera.set_centre_offset(mean.camera.centre_offset());
  state.corner_distortion = mean.corner_distortion;
  state.readout_s = mean.readout_s;
  state.mechanics = mean.mechanics;
  state.shift_s = match.shift_s;
  start->doubt = ask_for_degrees(match.focal_length, input.width);

  leave_out_frames_without_telemetry(match.shift_s, selected, excluded);
  TimeSpan span = observed_span(selected->data);
  if (selected->landmark_name.size() < kMinLandmarks || !(span.begin_s < span.end_s)) {
    return {CalibrationStatus::kBadInput, "video and telemetry hardly overlap in time"};
  }
  span.begin_s -= kMargin_s;
  span.end_s += kMargin_s;
  leave_out_telemetry_outside(span, match.shift_s, selected, excluded);

  auto trajectory = fit_telemetry(selected->data.telemetry, match.shift_s, span.begin_s, span.end_s,
                                  options.first_knot_spacing_s);
  if (!trajectory) {
    return {CalibrationStatus::kBadInput, "too few telemetry samples during the video"};
  }
  for (int i = 0; i < trajectory->control_points(); ++i) {
    trajectory->control_point(i)[0] /= state.mechanics.pan_scale;
    trajectory->control_point(i)[1] /= state.mechanics.tilt_scale;
  }
  state.trajectory = *trajectory;
  state.anchor = trajectory->position(0.5 * (span.begin_s + span.end_s));
  state.landmarks.resize(selected->landmark_name.size());
  initialise_landmarks(selected->data, &state);
  return {};
}

void initialise_landmarks(const AdjustmentData& data, AdjustmentState* state) {
  const Camera<double> camera = state->physical_camera();
  const Matrix3<double> R_anchor_from_base =
      R_base_from_camera(state->mechanics, state->anchor).transpose();
  std::vector<double> x;
  std::vector<double> y;
  std::vector<double> z;
  std::size_t next = 0;
  for (std::size_t l = 0; l < state->landmarks.size(); ++l) {
    x.clear();
    y.clear();
    z.clear();
    for (;
         next < data.observations.size() && data.observations[next].landmark == static_cast<int>(l);
         ++next) {
      const auto& o = data.observations[next];
      Vector3<double> d_c;
      if (unproject(camera, o.u, &d_c) != ProjectionStatus::kOk) continue;
      const double time =
          data.frame_time_s[static_cast<std::size_t>(o.frame)] + o.u.y() * state->line_delay();
      const Vector3<double> d =
          R_anchor_from_base *
          (R_base_from_camera(state->mechanics, state->trajectory.position(time)) * d_c);
      x.push_back(d.x());
      y.push_back(d.y());
      z.push_back(d.z());
    }
    Vector3<double> d = Vector3<double>::UnitX();
    if (!x.empty()) d = Vector3<double>(median(x), median(y), median(z));
    state->landmarks[l] = d.norm() > 0 ? Vector3<double>(d.normalized()) : Vector3<double>::UnitX();
  }
}

}  // namespace alidade::internal
