#pragma once
// What the samples of a pan/tilt source show beyond its data sheet. Pure functions; they allocate
// and do not throw, whatever the samples hold. Angles rad, times s.
//   polls       the median and the longest time between two samples
//   age         how old the newest known angle is just before the next sample is delivered. While
//               the head rests, a repeat is known to be true only up to max_repeat_s before its
//               time (TelemetryBuffer).
//   changes     how often the device measures: the median time between new values while the head
//               turns. Needs steps larger than rounding (2 steps on an axis); a head that creeps or
//               rests does not show it.
//   resolution  of each axis (stale_repeats.h)
//   bounds      latest - earliest of each sample: how well its time is known
//   stale       repeats of an old angle while the head turned (stale_repeats.h), as a share of all
//               samples while it turned. Two times give limits for max_repeat_s: how long an angle
//               was repeated, and when the next angle came.

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "core/realtime/telemetry/telemetry_buffer.h"
#include "edge_app/check/clock_check.h"
#include "edge_app/check/finding.h"
#include "edge_app/check/spread.h"
#include "edge_app/self_calibration/steady_samples.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct TelemetryNeeds {
  std::string source;
  std::optional<double> rate_hz;  // of the requested polls
  TelemetryLimits limits;         // as used by run
  double angle_sigma_rad = 1e-4;  // TelemetryNoise, as used by run
  double resolution_rad = 0;
  double focal_length_px = 0;  // 0: unknown
  double clock_offset_s = 0;   // images are looked up this much later
  std::optional<double> zoom;  // the calibration's
  std::string zooms;           // the same in words, with the zooms of its curve
  std::string lens_at_zoom;    // what is known of the lens at the latest zoom reading
  bool has_zoom_curve = false;
  // Device units: readings no further apart are one zoom. Empty: found from their jitter.
  std::optional<double> zoom_tolerance;
  bool makes_calibrations = true;  // run calibrates at another zoom
  bool landmarks = true;           // OE mode
};

struct AxisReport {
  double last = 0;   // rad
  double least = 0;  // rad, unwrapped
  double largest = 0;
  double resolution = 0;  // rad; 0: none found
  double top_rate = 0;    // rad/s: 95 % of the time the head turned no faster
};

struct TelemetryReport {
  std::size_t samples = 0;
  std::size_t useless = 0;        // samples that are not finite; ignored otherwise
  std::optional<double> rate_hz;  // of the samples that came
  std::optional<Spread> interval_s;
  std::optional<double> change_hz;  // new values a second while the head turns
  std::optional<Spread> bounds_s;
  std::optional<Spread> age_s;
  std::size_t negative_bounds = 0;  // samples whose latest time is before their earliest
  std::size_t turning = 0;          // samples taken while the head turned
  std::size_t stale = 0;
  double longest_stale_s = 0;   // from an angle's first sample to its last stale repeat
  double longest_change_s = 0;  // from an angle's first sample to the next angle
  AxisReport pan;
  AxisReport tilt;
  std::optional<double> zoom;        // latest reading, without jitter
  std::optional<double> other_zoom;  // an earlier one that differs by more than the tolerance
  ZoomJitter zoom_jitter;
  std::string lens_at_zoom;  // as in TelemetryNeeds
  ClockReport clock;
  // Samples for the motion check: finite, in order of time, fresh.
  std::vector<PanTiltSample> fresh;
  Findings findings;
};

// delivered_s: one for each sample: when it came from its source, on the clock of the sample times.
[[nodiscard]] TelemetryReport check_telemetry(const std::vector<PanTiltSample>& samples,
                                              const std::vector<double>& delivered_s,
                                              const ClockFilterOptions& clock,
                                              const TelemetryNeeds& needs);

[[nodiscard]] ReportLines describe(const TelemetryReport& report);

}  // namespace alidade
