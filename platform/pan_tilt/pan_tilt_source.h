#pragma once
// PanTiltSource: one interface for every origin of pan/tilt telemetry (Axis VAPIX, ONVIF, heads on
// serial lines, recording).
//
// Angles are radians as the device measures them (scale and axes are the calibration's business),
// turned into the axes of the model: pan positive to the right (about base z, down), tilt positive
// upwards (about base y, right). Times are seconds of the host's CLOCK_MONOTONIC. A polled value
// was true at some moment of [earliest_time_s, latest_time_s]. A sample may exist later than that: one
// paired from readings of one axis at a time comes half a cycle after its tilt (AxisPairing). Like
// FrameSource, a source reconnects by itself; read() blocks its own thread only, stop() ends it.

#include <cstdint>
#include <optional>
#include <string>

#include "platform/video/frame_source.h"  // ReadStatus

namespace alidade {

struct PanTiltSample {
  double earliest_time_s = 0;  // request sent (or, for a stream, the same as latest_time_s)
  double latest_time_s =
      0;  // first byte of the answer received, of a paired sample the tilt's, or later
  double pan_rad = 0;
  double tilt_rad = 0;
  std::optional<double> zoom;           // device units
  std::optional<double> device_time_s;  // device clock
  std::optional<std::int64_t> sequence;
  bool restarted = false;  // first sample after a (re)connection
};

class PanTiltSource {
 public:
  virtual ~PanTiltSource() = default;

  // Waits at most timeout_s for the next sample; a polling source paces itself. Fills sample on
  // kOk.
  [[nodiscard]] virtual ReadStatus read(PanTiltSample& sample, double timeout_s) = 0;

  // Thread-safe, idempotent. Every later read() returns kStopped.
  virtual void stop() = 0;

  // One line for the person; valid after kDisconnected or kFailed.
  [[nodiscard]] virtual std::string error() const = 0;

  // URL without password, device or directory.
  [[nodiscard]] virtual std::string name() const = 0;
};

}  // namespace alidade
