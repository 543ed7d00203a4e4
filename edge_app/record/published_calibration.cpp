#include "edge_app/record/published_calibration.h"

#include "core/calibration/calibration_goals.h"

namespace alidade {

MapState kept_map(const MapState& map) {
  // Far more than telemetry's error, but few enough pixels to find landmarks over: 30 at 30000 px.
  // If the base moved farther, landmarks contradict telemetry.
  constexpr double kMoved_rad = 1e-3;
  MapState kept = map;
  kept.offset_covariance += kMoved_rad * kMoved_rad * Matrix2<double>::Identity();
  return kept;
}

const char* to_string(CalibrationActivity activity) {
  switch (activity) {
    case CalibrationActivity::kOff:
      return "off";
    case CalibrationActivity::kCollecting:
      return "collecting";
    case CalibrationActivity::kAdjusting:
      return "adjusting";
    case CalibrationActivity::kWatching:
      return "watching";
    case CalibrationActivity::kDoubtful:
      return "doubtful";
  }
  return "unknown activity";
}

const char* to_string(CalibrationNeed need) {
  switch (need) {
    case CalibrationNeed::kNothing:
      return "";
    case CalibrationNeed::kVideo:
      return "video";
    case CalibrationNeed::kTelemetry:
      return "telemetry";
    case CalibrationNeed::kMotion:
      return "move the camera";
    case CalibrationNeed::kPan:
      return "pan more";
    case CalibrationNeed::kTilt:
      return "tilt more";
    case CalibrationNeed::kAcceleration:
      return "accelerate";
    case CalibrationNeed::kFarther:
      return to_string(HelpfulMotion::kFarther);
    case CalibrationNeed::kVaried:
      return to_string(HelpfulMotion::kVaried);
    case CalibrationNeed::kFaster:
      return to_string(HelpfulMotion::kFaster);
    case CalibrationNeed::kAcross:
      return to_string(HelpfulMotion::kAcross);
    case CalibrationNeed::kTexture:
      return "scene too plain";
    case CalibrationNeed::kAgreement:
      return "telemetry that describes the motion in the video";
    case CalibrationNeed::kPictures:
      return "more of the pictures: the machine is too slow or too busy";
    case CalibrationNeed::kFreshPictures:
      return "pictures that are not repeated";
    case CalibrationNeed::kTime:
      return "more of the same motion";
    case CalibrationNeed::kSteadyZoom:
      return "a steady zoom";
    case CalibrationNeed::kSteadyDelay:
      return "video whose delay does not wander";
    case CalibrationNeed::kYoungTelemetry:
      return "younger telemetry, or a larger realtime.max_extrapolation_s";
  }
  return "unknown need";
}

}  // namespace alidade
