#include "core/calibration/zoom_movement.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <unordered_set>
#include <utility>

#include "core/calibration/movement_adjustment.h"
#include "core/calibration/number_text.h"
#include "core/calibration/recording_clocks.h"
#include "core/calibration/telemetry_fit.h"

namespace alidade {
namespace {

using internal::MovementAdjustment;
using internal::MovementData;
using internal::RecordingClocks;
using internal::SelectedInput;

// A movement is taken to begin and end kGuard_s beyond its readings, as image and telemetry clocks
// agree only to that. Of each dwell, another kRest_s are used.
constexpr double kGuard_s = 0.15;
constexpr double kRest_s = 0.8;
constexpr int kLeastLandmarks = 20;
constexpr double kLoose = 0.05;         // sigma of log f; beyond it no landmark was followed there
constexpr double kWorstPixelRatio = 4;  // residuals / stated noise

// The movement's zoom readings at times of the image clock.
std::vector<ZoomReading> readings_by_image(const ZoomMovement& movement,
                                           const SelectedInput& selected, double clock_offset) {
  std::vector<ZoomReading> readings;
  std::size_t next = 0;
  for (const ZoomReading& reading : movement.readings) {
    if (!std::isfinite(reading.zoom) || !std::isfinite(reading.time_s)) continue;
    while (next < selected.telemetry_index.size() &&
           movement.input.telemetry[selected.telemetry_index[next]].stamp_s < reading.time_s) {
      ++next;
    }
    double time = reading.time_s;
    if (next < selected.telemetry_index.size() &&
        movement.input.telemetry[selected.telemetry_index[next]].stamp_s == reading.time_s) {
      time = selected.data.telemetry[next].time_s;
    }
    readings.push_back({time - clock_offset, reading.zoom});
  }
  return readings;
}

// The readings during the movement, with the last of the first dwell and the first of the second.
bool passed_readings(const ZoomMovement& movement, const std::vector<ZoomReading>& all,
                     std::vector<ZoomReading>* passed, std::string* error) {
  const double sign = movement.to.zoom > movement.from.zoom ? 1 : -1;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const double stamp = movement.readings[i].time_s;
    if (stamp < movement.from.end_s || stamp > movement.to.begin_s) continue;
    if (!passed->empty() && sign * (all[i].zoom - passed->back().zoom) < 0) {
      *error = "the zoom reading goes to and fro";
      return false;
    }
    passed->push_back(all[i]);
  }
  if (passed->size() >= 4) return true;
  *error = "fewer than 4 zoom readings came on the way";
  return false;
}

// Smallest step between consecutive readings that differ; 0 if none do.
double step_of(const std::vector<ZoomReading>& readings) {
  double step = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < readings.size(); ++i) {
    const double difference = std::abs(readings[i].zoom - readings[i - 1].zoom);
    if (difference > 0) step = std::min(step, difference);
  }
  return std::isfinite(step) ? step : 0;
}

double log_f_of(const ZoomCurve& curve, double reading) {
  Calibration c;
  return curve.at(reading, &c) ? std::log(c.camera.focal_length) : 0;
}

// Keeps the observations of frames from begin to end (image clock).
void keep_between(double begin_s, double end_s, SelectedInput* selected) {
  auto& observations = selected->data.observations;
  const auto outside = [&](const internal::AdjustmentObservation& seen) {
    const double time = selected->data.frame_time_s[static_cast<std::size_t>(seen.frame)];
    return time < begin_s || time > end_s;
  };
  observations.erase(std::remove_if(observations.begin(), observations.end(), outside),
                     observations.end());
  // Keeps landmarks with two observations or more, and renumbers them.
  std::vector<internal::AdjustmentObservation> kept;
  int count = 0;
  for (std::size_t i = 0; i < observations.size();) {
    std::size_t end = i + 1;
    while (end < observations.size() && observations[end].landmark == observations[i].landmark)
      ++end;
    if (end - i > 1) {
      for (std::size_t j = i; j < end; ++j) {
        kept.push_back(observations[j]);
        kept.back().landmark = count;
      }
      ++count;
    }
    i = end;
  }
  observations = std::move(kept);
}

// log f where a reading was passed: the curve's, plus the spline's deviation from the curve,
// interpolated between the two samples around it.
struct Crossing {
  double reading = 0;
  Eigen::VectorXd row;  // of the adjustment's unknowns
  double value = 0;
  double rate_per_s = 0;
  double variance = 0;  // of the readings' rounding and stamps
};

Crossing crossing_at(double reading, const ZoomReading& before, const ZoomReading& after,
                     const ZoomCurve& curve, const MovementAdjustment& adjustment, double step,
                     double stamp_sigma_s) {
  Crossing crossing;
  crossing.reading = reading;
  const double share = (reading - before.zoom) / (after.zoom - before.zoom);
  crossing.row = (1 - share) * adjustment.log_f_row(before.time_s) +
                 share * adjustment.log_f_row(after.time_s);
  const double base_before = log_f_of(curve, before.zoom);
  const double base_after = log_f_of(curve, after.zoom);
  crossing.value = log_f_of(curve, reading) +
                   (1 - share) * (adjustment.log_f(before.time_s) - base_before) +
                   share * (adjustment.log_f(after.time_s) - base_after);
  crossing.rate_per_s = (1 - share) * adjustment.log_f_rate(before.time_s) +
                        share * adjustment.log_f_rate(after.time_s);
  const double shares = (1 - share) * (1 - share) + share * share;
  const double slope = (base_after - base_before) / (after.zoom - before.zoom);
  crossing.variance = shares * (slope * slope * step * step / 12 +
                                std::pow(crossing.rate_per_s * stamp_sigma_s, 2));
  return crossing;
}

}  // namespace

bool observe_movement(const ZoomMovement& movement, const ZoomCurve& curve,
                      const std::vector<double>& readings, MovementObservation* observation,
                      std::string* error) {
  *observation = {};
  if (curve.empty()) {
    *error = "there is no zoom curve yet";
    return false;
  }
  const Calibration& shared = curve.content().shared;
  const double length = movement.to.begin_s - movement.from.end_s;
  if (!(length > 0 && length <= kLongestMovement_s)) {
    *error = "it takes " + short_text(length) + " s, more than " + short_text(kLongestMovement_s);
    return false;
  }
  SelectedInput selected;
  CalibrationExclusions excluded;
  const internal::StageStatus status = internal::select_input(movement.input, &selected, &excluded);
  if (!status.ok()) {
    *error = status.message;
    return false;
  }
  CalibrationOptions stamps;
  stamps.image_stamps = movement.image_stamps;
  stamps.telemetry_stamps = movement.telemetry_stamps;
  const RecordingClocks clocks = internal::fit_clocks(movement.input, stamps, &selected);
  internal::unwrap(&selected.data.telemetry);

  MovementData data;
  const std::vector<ZoomReading> all = readings_by_image(movement, selected, shared.clock_offset);
  std::vector<ZoomReading> passed;
  if (all.size() != movement.readings.size()) {
    *error = "a zoom reading is not finite";
    return false;
  }
  if (!passed_readings(movement, all, &passed, error)) return false;
  data.passed = passed;
  data.rest_ends_s = passed.front().time_s - kGuard_s;
  data.rest_begins_s = passed.back().time_s + kGuard_s;
  data.begin_s = std::max(data.rest_ends_s - kRest_s, movement.from.begin_s - shared.clock_offset);
  data.end_s = std::min(data.rest_begins_s + kRest_s, movement.to.end_s - shared.clock_offset);
  keep_between(data.begin_s, data.end_s, &selected);
  data.frame_period_s = clocks.image.period_s;
  data.pan_tilt_sigma_rad = movement.input.noise.pan_tilt_sigma_rad.value_or(0);
  data.width = movement.input.width;
  data.height = movement.input.height;
  data.input = std::move(selected.data);

  MovementAdjustment adjustment(std::move(data), curve);
  if (adjustment.landmarks() < kLeastLandmarks) {
    *error = "only " + std::to_string(adjustment.landmarks()) + " landmarks are followed; " +
             std::to_string(kLeastLandmarks) + " are needed";
    return false;
  }
  if (!adjustment.run(error)) return false;
  if (adjustment.pixel_sigma_ratio() > kWorstPixelRatio) {
    *error =
        "the tracks are " + short_text(adjustment.pixel_sigma_ratio()) + " times their sigmas off";
    return false;
  }

  std::vector<Crossing> crossings;
  const double step = step_of(passed);
  const double stamp_sigma = clocks.telemetry.steady ? 0 : clocks.telemetry.stamp_sigma_s;
  for (const double reading : readings) {
    for (std::size_t i = 1; i < passed.size(); ++i) {
      const double part = (reading - passed[i - 1].zoom) / (passed[i].zoom - passed[i - 1].zoom);
      if (!(part >= 0 && part < 1)) continue;
      const Crossing crossing =
          crossing_at(reading, passed[i - 1], passed[i], curve, adjustment, step, stamp_sigma);
      const double variance = crossing.row.dot(adjustment.covariance() * crossing.row);
      if (variance < kLoose * kLoose) crossings.push_back(crossing);
      break;
    }
  }
  if (crossings.empty()) {
    *error = "no landmarks are followed through it";
    return false;
  }
  const auto size = static_cast<Eigen::Index>(2 + crossings.size());
  Eigen::MatrixXd rows(size, adjustment.unknowns());
  observation->log_focal_length.resize(size);
  observation->rate_per_s = Eigen::VectorXd::Zero(size);
  for (const int rest : {0, 1}) {
    const double time = rest == 0 ? adjustment.begin_s() : adjustment.end_s();
    rows.row(rest) = adjustment.log_f_row(time).transpose();
    observation->log_focal_length[rest] = adjustment.log_f(time);
  }
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(2 + i);
    rows.row(at) = crossings[i].row.transpose();
    observation->log_focal_length[at] = crossings[i].value;
    observation->rate_per_s[at] = crossings[i].rate_per_s;
    observation->reading.push_back(crossings[i].reading);
  }
  observation->covariance = rows * adjustment.covariance() * rows.transpose();
  for (std::size_t i = 0; i < crossings.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(2 + i);
    observation->covariance(at, at) += crossings[i].variance;
  }
  // The offsets of the lines through the stamps err anew in each movement.
  const Eigen::VectorXd& rate = observation->rate_per_s;
  observation->covariance +=
      (std::pow(clocks.image.offset_sigma_s, 2) + std::pow(clocks.telemetry.offset_sigma_s, 2)) *
      rate * rate.transpose();
  observation->pixel_sigma_ratio = adjustment.pixel_sigma_ratio();
  observation->frames = adjustment.frames();
  observation->landmarks = adjustment.landmarks();
  return true;
}

std::vector<ZoomMovement> find_movements(const CalibrationInput& input,
                                         const std::vector<ZoomReading>& readings,
                                         const std::vector<ZoomStretch>& rests) {
  std::vector<ZoomMovement> movements;
  for (std::size_t i = 1; i < rests.size(); ++i) {
    const ZoomStretch& from = rests[i - 1];
    const ZoomStretch& to = rests[i];
    if (from.zoom == to.zoom) continue;
    ZoomMovement movement;
    movement.from = from;
    movement.to = to;
    CalibrationInput& part = movement.input;
    part.width = input.width;
    part.height = input.height;
    part.noise = input.noise;
    std::unordered_set<std::int64_t> names;
    const auto is_within = [&](double time, double margin) {
      return time >= from.begin_s - margin && time <= to.end_s + margin;
    };
    // Image and telemetry clocks differ. A second more of the images does no harm.
    constexpr double kAround_s = 1;
    for (const CalibrationFrame& frame : input.frames) {
      if (!is_within(frame.stamp_s, 0)) continue;
      part.frames.push_back(frame);
      if (frame.stamp_s >= from.end_s - kAround_s - kRest_s - kGuard_s &&
          frame.stamp_s <= to.begin_s + kAround_s + kRest_s + kGuard_s) {
        names.insert(frame.frame);
      }
    }
    for (const CalibrationTelemetry& sample : input.telemetry) {
      if (is_within(sample.stamp_s, 0)) part.telemetry.push_back(sample);
    }
    for (const CalibrationObservation& seen : input.observations) {
      if (names.count(seen.frame) > 0) part.observations.push_back(seen);
    }
    for (const ZoomReading& reading : readings) {
      if (is_within(reading.time_s, 0)) movement.readings.push_back(reading);
    }
    movements.push_back(std::move(movement));
  }
  return movements;
}

}  // namespace alidade
