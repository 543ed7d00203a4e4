#pragma once
// OrientationRecord: what `alidade` says about one frame, and RecordSink, where the records go.
//
// Angles are TRUE angles of the mechanism (measured / scale), rad, and with the rates and q hold at
// time_s, when row 0 was exposed; at row v both angles are
//   angle + rate t + acceleration t^2 / 2,  t = v * line delay.
// q is R_base_from_camera; covariance and sigma are of a perturbation R * Exp(xi), xi in the camera frame.
// A record without a frame (video lost) has neither frame nor time_s; one of mode `none` has no
// orientation and its status says why. Where landmarks were looked for and the answer is telemetry's
// (mode PT), the status says why too.
// Fixed size and trivially copyable: crosses the queue to the output thread by value.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>

#include "edge_app/pipeline/frame_geometry.h"
#include "edge_app/pipeline/published_calibration.h"

namespace alidade {

enum class RecordMode : std::uint8_t { kNone, kPt, kOe };

enum class RecordStatus : std::uint8_t {
  kOk,
  kClockWarmingUp,    // mode PT or OE: too few frames since the (re)start to know their times well
  kVideoLost,         // no connection to the video source
  kTelemetryLost,     // no connection to the pan/tilt source, and its last sample is too old
  kTelemetryMissing,  // fewer than two usable samples so far
  kTelemetryTooOld,   // the frame lies further beyond the newest sample than may be extrapolated
  kTelemetryGap,      // the samples around the frame lie too far apart
  kFrameBeforeTelemetry,  // the frame is older than the oldest sample kept
  kTooFewLandmarks,       // mode PT: too few landmarks held
  kContradiction,         // mode PT: landmarks and telemetry exclude each other
  kBadImage,              // mode PT: no picture, or one that is not of the calibration's size
  kPictureTooLate,        // mode PT: others waited behind the frame, which went without its picture
  kOtherZoom,             // no calibration for the zoom that the pan/tilt source reports
  kNotFinite              // a stamp is not a finite number
};

constexpr const char* to_string(RecordMode mode) {
  switch (mode) {
    case RecordMode::kNone:
      return "none";
    case RecordMode::kPt:
      return "PT";
    case RecordMode::kOe:
      return "OE";
  }
  return "unknown mode";
}

constexpr const char* to_string(RecordStatus status) {
  switch (status) {
    case RecordStatus::kOk:
      return "ok";
    case RecordStatus::kClockWarmingUp:
      return "clock filter warming up";
    case RecordStatus::kVideoLost:
      return "video lost";
    case RecordStatus::kTelemetryLost:
      return "telemetry lost";
    case RecordStatus::kTelemetryMissing:
      return "too little telemetry";
    case RecordStatus::kTelemetryTooOld:
      return "telemetry too old";
    case RecordStatus::kTelemetryGap:
      return "gap in telemetry";
    case RecordStatus::kFrameBeforeTelemetry:
      return "frame before telemetry";
    case RecordStatus::kTooFewLandmarks:
      return "too few landmarks";
    case RecordStatus::kContradiction:
      return "landmarks contradict telemetry";
    case RecordStatus::kBadImage:
      return "no usable picture";
    case RecordStatus::kPictureTooLate:
      return "picture too late";
    case RecordStatus::kOtherZoom:
      return "no calibration for this zoom";
    case RecordStatus::kNotFinite:
      return "not finite";
  }
  return "unknown status";
}

struct OrientationRecord {
  struct Orientation {
    double pan_rad = 0;
    double tilt_rad = 0;
    double pan_rate_rad_s = 0;
    double tilt_rate_rad_s = 0;
    double pan_acceleration_rad_s2 = 0;  // 0 in mode PT
    double tilt_acceleration_rad_s2 = 0;
    std::array<double, 4> q_base_from_camera{0, 0, 0, 1};  // x, y, z, w
    std::array<double, 3> sigma_rad{};
    std::array<double, 9> covariance_rad2{};  // row by row
    FrameGeometry geometry;                   // for directions of its pixels
  };

  std::optional<std::int64_t> frame;
  std::optional<double> time_s;  // capture of row 0 on the filtered host clock
  double time_sigma_s = 0;       // of time_s, as the clock filter has it
  bool clock_locked = false;     // the clock filter has seen enough
  double receive_time_s = 0;     // of the frame, or of the news of the loss
  RecordMode mode = RecordMode::kNone;
  RecordStatus status = RecordStatus::kOk;
  bool calibrated = false;        // false: data-sheet values
  CalibrationReport calibration;  // what the calibration thread does and needs
  std::optional<Orientation> orientation;
  int landmarks = 0;  // that held it: 0 but in mode OE
  // Root mean square of their residuals' lengths, px; none but in mode OE.
  std::optional<double> residual_px;
  PlainCalibration camera;          // the calibration in use
  std::optional<double> latency_s;  // record made minus receive time; none in a replay
};
static_assert(std::is_trivially_copyable_v<OrientationRecord>);

// Where records go. Called by one thread (output), but for interrupt().
class RecordSink {
 public:
  virtual ~RecordSink() = default;

  // False: no further record can be written, see error(); the program should end.
  [[nodiscard]] virtual bool write(const OrientationRecord& record) = 0;

  // Thread-safe. From now on write() does not wait for a slow reader.
  virtual void interrupt() = 0;

  // One line; empty if the reader merely went away (a closed pipe), which is not a failure.
  [[nodiscard]] virtual std::string error() const = 0;
};

}  // namespace alidade
