#pragma once
// PublishedCalibration: a calibration and the map made with it, as one object that never changes,
// for the real-time thread. CalibrationReport: what the calibration thread does and needs, for
// records and log.

#include <cstdint>
#include <string>

#include "core/model/calibration.h"
#include "core/model/lens/zoom_curve.h"
#include "core/model/telemetry_error.h"
#include "core/realtime/oe_mode/map_state.h"

namespace alidade {

struct PublishedCalibration {
  Calibration calibration;
  bool calibrated = false;         // false: data-sheet values; landmarks are not looked for
  MapState map;                    // may be empty
  std::string name;                // for people: a file, "data sheet", "live"
  ZoomCurve zoom_curve;            // for other zooms, and while the zoom moves; may be empty
  TelemetryError telemetry_error;  // of the head, at any zoom; may be empty
  // The clock offset was found through the present connection. False: perhaps through another one,
  // whose least delay may differ.
  bool of_this_connection = true;
};

// Prepares a map from before a restart, or of another zoom, for use now. Such a map knows the base
// more precisely than telemetry does, but the base or the head's zero may have moved since. So its
// offset gets a covariance of (1 mrad)^2 more, and telemetry's first answers determine it.
[[nodiscard]] MapState kept_map(const MapState& map);

// What the calibration thread is doing.
enum class CalibrationActivity : std::uint8_t {
  kOff,         // no automatic calibration: the calibration stays as it is
  kCollecting,  // no calibration for this camera at this zoom: waits for motion
  kAdjusting,   // computes a calibration
  kWatching,    // there is a calibration; new data tests and refines it
  kDoubtful     // the calibration is withdrawn (landmarks contradict telemetry), collects anew
};

// What would help the calibration.
enum class CalibrationNeed : std::uint8_t {
  kNothing,
  kVideo,          // no frames come
  kTelemetry,      // no pan/tilt samples come
  kMotion,         // the camera must move
  kPan,            // the camera only tilts
  kTilt,           // the camera only pans
  kAcceleration,   // constant velocity: clock offset and line delay stay unknown
  kFarther,        // a calibration was found, but its focal length is too uncertain
  kVaried,         // likewise its clock offset
  kFaster,         // likewise its line delay
  kAcross,         // likewise its distortion
  kTexture,        // scene too plain: too few landmarks
  kAgreement,      // telemetry does not describe the motion in the video
  kPictures,       // most pictures never come here: the machine has too much to do
  kFreshPictures,  // pictures are sent again while the camera turns
  kTime,           // more of the same motion
  kSteadyZoom,     // the zoom is moving
  kSteadyDelay,    // the video's delay wanders
  kYoungTelemetry  // trusted angles come too late or too seldom for many frames
};

[[nodiscard]] const char* to_string(CalibrationActivity activity);
[[nodiscard]] const char* to_string(CalibrationNeed need);  // "tilt more"; empty for kNothing

struct alignas(2) CalibrationReport {  // one unit to every compiler: threads exchange it whole
  CalibrationActivity activity = CalibrationActivity::kOff;
  CalibrationNeed need = CalibrationNeed::kNothing;
};

}  // namespace alidade
