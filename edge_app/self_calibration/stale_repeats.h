#pragma once
// What the values of polled telemetry tell of the device behind them: the step of its angles, and which
// samples only repeat an old angle.
//
// A device that is polled faster than it measures gives the same values again. Such a repeat was true when
// it first came; where the head turned meanwhile it says nothing of its own time, and is stale. It is
// recognised by the samples around it: a run of equal values, lasting from t_a to t_b, between values u
// before and w after it (each at its first time), is stale after its first sample if on one axis
//   the head turned one way all the while: u -> v, v -> w and what follows w have the same sign,
//   it should have left v by more than rounding hides: the lower of the rates before and after, times
//   (t_b - t_a), of which the intervals of both samples are taken off, exceeds 1.5 resolutions,
//   and did: |w - v| is at least 3/4 of what the mean of the two rates makes of the whole time from t_a to w.
// The last tells a device that was not measured from a head that stood still and moved on: that has only
// the last interval for w - v, which is half of the whole time or less. What cannot be told is not stale.
//
// This looks back on finished data: `calibrate`, the calibration thread and `check` leave stale repeats out.
// The real-time step cannot wait for what follows; TelemetryBuffer (core/realtime) takes every repeat
// younger than pan_tilt.max_repeat_s as unknown instead. Both take a value as true when it first came, so a
// clock offset that one finds holds for the other.
// Radians, seconds; a sample's time is the middle of its interval. Pure functions; they allocate.

#include <cstddef>
#include <vector>

#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

// The largest step of which differences between the angles of one axis are whole multiples, as far as the
// data show: of neighbouring angles, put in order of size, 19 of 20 lie within 3 % of q of a whole multiple. Printed
// digits and single wild angles do not matter. 0: none, or too little motion to tell. (The calibration's own,
// core/calibration/initialization.h, asks more: that every step of an axis is a whole multiple.)
[[nodiscard]] double device_resolution(const std::vector<double>& angles_rad);

// For each sample, in order of time. A sample that begins anew after a reconnection repeats nothing.
[[nodiscard]] std::vector<bool> find_stale_repeats(const std::vector<PanTiltSample>& samples);

// The time of a sample that was true somewhere in its interval.
[[nodiscard]] inline double middle_time_s(const PanTiltSample& sample) {
  return 0.5 * (sample.earliest_time_s + sample.latest_time_s);
}

// Equal values in a row: samples [begin, end).
struct EqualRun {
  std::size_t begin = 0;
  std::size_t end = 0;
};
[[nodiscard]] std::vector<EqualRun> equal_runs(const std::vector<PanTiltSample>& samples);

}  // namespace alidade
