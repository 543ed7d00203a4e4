#pragma once
// OrientationRecord: what `alidade` says about one frame, and RecordSink, where the records go.
//
// Angles are TRUE angles of the mechanism (measured / scale), rad, and with the rates and q hold at
// time_s, when row 0 was exposed; at row v both angles are
//   angle + rate t + acceleration t^2 / 2,  t = v * line delay.
// q is R_base_from_camera; covariance and sigma are of a perturbation R * Exp(xi), xi in the camera frame.
// A record without a frame (video lost) has neither frame nor time_s, one of a frame that may have waited no time_s; one of
// mode `none` has no orientation and its status says why. Where OE mode is asked for and the answer is telemetry's
// (mode PT), the status says why too: `ok` is of mode OE then.
// Fixed size and trivially copyable: crosses the queue to the output thread by value.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>

#include "edge_app/record/frame_geometry.h"
#include "edge_app/record/published_calibration.h"
#include "edge_app/record/record_status.h"

namespace alidade {

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
  double time_sigma_s = 0;       // of time_s, against what the clock offset was found with
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
  PlainCalibration camera;  // the calibration in use
  // What the pan/tilt source has reported last, in its own scale; none: it reports no zoom.
  std::optional<double> zoom;
  // How far the frame's middle row, looked up at time_s + clock offset, lies beyond the newest trusted angle of telemetry, s: what
  // max_extrapolation_s bounds. Negative: samples enclose it. None without a sample.
  std::optional<double> telemetry_age_s;
  // The frame that tied the record to the scene map's base; none: the base is telemetry's.
  struct Localized {
    double age_s = 0;      // of that frame
    double sigma_rad = 0;  // that the tie adds to a direction, root mean square of pan's and tilt's
    PanTilt<double> telemetry_zero;  // rad, in the map's base: what telemetry's true angles lack
  };
  std::optional<Localized> localized;
  std::optional<double> latency_s;  // record made minus receive time; none in a replay
};
static_assert(std::is_trivially_copyable_v<OrientationRecord>);

// Of row 0, angles wrapped to [-pi, pi), w of the quaternion >= 0.
[[nodiscard]] OrientationRecord::Orientation orientation_of(const FrameOrientation& frame);

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
