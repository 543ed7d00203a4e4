#pragma once
// Stale repeats in polled telemetry, and the angular resolution of the device.
//
// A device that is polled faster than it measures repeats its last value. The value was true when
// it first came. If the head has turned meanwhile, the repeat is stale: it shows nothing about its
// own time. In a run of equal values, all but the first sample are stale if the samples around the
// run show that the head turned on. In doubt a sample is not stale. Derivation:
// docs/derivations.md. These functions need the whole data: `calibrate`, the calibration thread and
// `check` use them. The real-time step cannot wait: TelemetryBuffer takes every repeat younger than
// pan_tilt.max_repeat_s as unknown. Both take a value as true when it first came, so a clock offset
// found with one holds for the other. Radians, seconds; a sample's time is the middle of its
// interval. Pure functions; they allocate.

#include <cstddef>
#include <vector>

#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

// The largest step q (rad) of which the differences between the angles of one axis are whole
// multiples: when the angles are sorted, 19 of 20 gaps between neighbours are within 3 % of q of a
// multiple. Printed digits and single wild angles do not matter. 0: no such step, or too little
// motion to tell. (angle_resolution() in core/calibration/rounded_telemetry.h is stricter: every
// reading must be a multiple.)
[[nodiscard]] double device_resolution(const std::vector<double>& angles_rad);

// Whether each sample is a stale repeat. samples: in order of time. The first sample after a
// reconnection repeats nothing.
[[nodiscard]] std::vector<bool> find_stale_repeats(const std::vector<PanTiltSample>& samples);

// Whether a polled device is known, at the end, to renew its angles about as often as it is asked or
// less often (RenewalAge): it repeated some while the head turned. least_rad: RenewalAge::least_turn().
// longest_s: TelemetryLimits::max_repeat_s.
[[nodiscard]] bool renews_seldom(const std::vector<PanTiltSample>& samples, double least_rad,
                                 double longest_s);

// The time of a sample, s: the middle of its interval.
[[nodiscard]] inline double middle_time_s(const PanTiltSample& sample) {
  return 0.5 * (sample.earliest_time_s + sample.latest_time_s);
}

// Equal values in a row: samples [begin, end).
struct EqualRun {
  std::size_t begin = 0;
  std::size_t end = 0;
};
// All samples, in order; a run may have one sample.
[[nodiscard]] std::vector<EqualRun> equal_runs(const std::vector<PanTiltSample>& samples);

}  // namespace alidade
