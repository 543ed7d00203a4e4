#pragma once
// OrientationRecord: the result for one frame. RecordSink: where the records go.
// Angles are TRUE angles of the mechanism (measured / scale), rad. Angles, rates and q hold at
// time_s, when row 0 was exposed. At row v each angle is
//   angle + rate t + acceleration t^2 / 2,  t = v * line delay.
// q is R_base_from_camera. Covariance and sigma are of a perturbation R * Exp(xi), camera frame.
// A record of a lost video has neither frame nor time_s; the record of a frame that may have waited
// has no time_s. In mode `none` there is no orientation. If OE mode is asked for, the status `ok`
// means mode OE. Fixed size and trivially copyable, for the queue to the output thread.

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
    std::array<double, 3> sigma_rad{};                     // standard deviations, camera frame
    std::array<double, 9> covariance_rad2{};               // row by row
    FrameGeometry geometry;                                // gives its pixels directions
  };

  std::optional<std::int64_t> frame;
  std::optional<double> time_s;  // s, host clock, filtered: capture of row 0
  double time_sigma_s = 0;       // s, of time_s, relative to the clock offset's calibration
  bool clock_locked = false;     // the frame's time is known as well as it will be
  double receive_time_s = 0;     // s, of the frame, or of the news of the loss
  RecordMode mode = RecordMode::kNone;
  RecordStatus status = RecordStatus::kOk;
  bool calibrated = false;        // false: data-sheet values
  CalibrationReport calibration;  // what the calibration thread does and needs
  std::optional<Orientation> orientation;
  int landmarks = 0;  // number that support the orientation; 0 unless in mode OE
  // px, root mean square length of their residuals; empty unless in mode OE.
  std::optional<double> residual_px;
  // rad, telemetry's true angles minus the answer's, in the base of the record, when the middle row
  // was exposed. Empty unless in mode OE with telemetry for this frame.
  std::optional<PanTilt<double>> telemetry_error;
  PlainCalibration camera;  // the calibration in use
  // Device units: the reading that the pan/tilt source reported last. Empty: it reports no zoom.
  std::optional<double> zoom;
  // s, how far the frame's middle row, looked up at time_s + clock offset, lies beyond the newest
  // trusted angle of telemetry; max_extrapolation_s at most. Negative: samples enclose the frame.
  // Empty: there is no sample, or no time_s.
  std::optional<double> telemetry_age_s;
  // The frame that tied the record to the scene map's base. Empty: the base is telemetry's, or the
  // record has no orientation.
  struct Localized {
    double age_s = 0;      // of that frame
    double sigma_rad = 0;  // that the tie adds to a direction: root mean square of pan and tilt
    // rad, to be added to telemetry's true angles to be in the map's base.
    PanTilt<double> telemetry_zero;
    std::array<double, 3> zero_covariance{};  // rad^2, of it: pan, pan with tilt, tilt
  };
  std::optional<Localized> localized;
  std::optional<double> latency_s;  // s, record made minus receive time; empty with recordings
};
static_assert(std::is_trivially_copyable_v<OrientationRecord>);

// The orientation at row 0: angles wrapped to [-pi, pi), w of the quaternion >= 0.
[[nodiscard]] OrientationRecord::Orientation orientation_of(const FrameOrientation& frame);

// Where the records go. Called by the output thread alone, except for interrupt().
class RecordSink {
 public:
  virtual ~RecordSink() = default;

  // False: no further record can be written, and the program should end; see error().
  [[nodiscard]] virtual bool write(const OrientationRecord& record) = 0;

  // Thread-safe. From now on write() does not wait for a slow reader.
  virtual void interrupt() = 0;

  // One line; empty if the reader merely went away (a closed pipe), which is not a failure.
  [[nodiscard]] virtual std::string error() const = 0;
};

}  // namespace alidade
