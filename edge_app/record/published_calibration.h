#pragma once
// PublishedCalibration: what the calibration thread hands to the real-time thread: a calibration and the map
// made with it, as one object that is never changed. CalibrationReport: what the calibration thread
// is doing and what it needs, for records and log.

#include <cstdint>
#include <string>

#include "core/model/calibration.h"
#include "core/model/zoom_curve.h"
#include "core/realtime/oe_mode/map_state.h"

namespace alidade {

struct PublishedCalibration {
  Calibration calibration;
  bool calibrated = false;  // false: the data sheet's values; landmarks are not looked for
  MapState map;             // may be empty
  std::string name;         // for people: a file, "data sheet", "live"
  ZoomCurve zoom_curve;     // for other zooms, and while the zoom moves; may be empty
};

// A map from before a restart, or kept for another zoom, as it may be handed over: it knows the base to a fraction of what
// telemetry does, but not by how much that was moved meanwhile, or the head's zero. Telemetry's first answers tell.
[[nodiscard]] MapState kept_map(const MapState& map);

// What the calibration thread is doing.
enum class CalibrationActivity : std::uint8_t {
  kOff,         // no automatic calibration: the calibration stays as it is
  kCollecting,  // no calibration for this camera at this zoom: watches the camera move
  kAdjusting,   // computes one
  kWatching,    // there is one; new data is held against it, and refines it
  kDoubtful     // there is one that landmarks or telemetry contradict: withdrawn, collects anew
};

// What would help it.
enum class CalibrationNeed : std::uint8_t {
  kNothing,
  kVideo,          // no frames come
  kTelemetry,      // no pan/tilt samples come
  kMotion,         // the camera must move
  kPan,            // it tilts only
  kTilt,           // it pans only
  kAcceleration,   // constant velocity: clock offset and line delay stay unknown
  kTexture,        // scene too plain: too few landmarks
  kAgreement,      // telemetry does not describe the motion in the video
  kPictures,       // most of them never come here: the machine has too much to do
  kTime,           // more of the same
  kSteadyZoom,     // the zoom is moving
  kSteadyDelay,    // the video's delay wanders
  kYoungTelemetry  // trusted angles come so late, or so seldom, that frames get none
};

[[nodiscard]] const char* to_string(CalibrationActivity activity);
[[nodiscard]] const char* to_string(CalibrationNeed need);  // "tilt more"; empty for kNothing

struct alignas(2) CalibrationReport {  // one word to every compiler: threads exchange it whole
  CalibrationActivity activity = CalibrationActivity::kOff;
  CalibrationNeed need = CalibrationNeed::kNothing;
};

}  // namespace alidade
