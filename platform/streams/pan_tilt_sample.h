#pragma once
// Samples of any telemetry source.
//
// Angles are radians as the device measures them (the calibration handles scale and axes), in the
// axes of the model: pan positive to the right (about base z, down), tilt positive upwards (about
// base y, right). Times are seconds of the host's CLOCK_MONOTONIC. A polled value was true at some
// moment of [earliest_time_s, latest_time_s]. The sample may be delivered later than
// latest_time_s: a sample paired from readings of single axes comes half a cycle after its tilt
// (AxisPairing).

#include <cstdint>
#include <optional>

namespace alidade {

struct PanTiltSample {
  double earliest_time_s = 0;  // request sent (a stream: the same as latest_time_s)
  // Answer's first byte received, or a little later; of a paired sample, see AxisPairing.
  double latest_time_s = 0;
  double pan_rad = 0;
  double tilt_rad = 0;
  std::optional<double> zoom;            // device units
  std::optional<double> device_time_s;   // s, device clock, any epoch
  std::optional<std::int64_t> sequence;  // the device's count of samples; a gap is a loss
  bool restarted = false;                // first sample after a (re)connection
};

}  // namespace alidade
