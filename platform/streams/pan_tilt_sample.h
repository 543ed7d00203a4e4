#pragma once
// What flows from every telemetry link.
//
// Angles are radians as the device measures them (scale and axes are the calibration's business),
// turned into the axes of the model: pan positive to the right (about base z, down), tilt positive
// upwards (about base y, right). Times are seconds of the host's CLOCK_MONOTONIC. A polled value
// was true at some moment of [earliest_time_s, latest_time_s]. A sample may exist later than that: one
// paired from readings of one axis at a time comes half a cycle after its tilt (AxisPairing).

#include <cstdint>
#include <optional>

namespace alidade {

struct PanTiltSample {
  double earliest_time_s = 0;  // request sent (or, for a stream, the same as latest_time_s)
  // first byte of the answer received, of a paired sample the tilt's, or later
  double latest_time_s = 0;
  double pan_rad = 0;
  double tilt_rad = 0;
  std::optional<double> zoom;           // device units
  std::optional<double> device_time_s;  // device clock
  std::optional<std::int64_t> sequence;
  bool restarted = false;  // first sample after a (re)connection
};

}  // namespace alidade
