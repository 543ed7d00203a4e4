#pragma once
// RecordMode and RecordStatus: how a record's orientation was found, and why it is not better or is none at all.
//
// A status comes from one of these:
//   TelemetryBuffer::query()   how the frame lies to the telemetry samples (QueryStatus)
//   OeMode::process()          whether landmarks held (OeStatus); for frames that telemetry has an answer for
//   FrameClock                 whether the frame's time is known
//   OrientationStep            no calibration, zoom, loss of the video, images sent again (RepeatedImages), not localized yet (SceneStart)
//   RealtimeStage              images that came too late to be looked at
// Where OE mode is asked for, kOk is of mode OE alone. What a person reads of each, and what to do: edge_app/README.md.

#include <array>
#include <cstddef>
#include <cstdint>

namespace alidade {

enum class OeStatus;
enum class QueryStatus;

enum class RecordMode : std::uint8_t { kNone, kPt, kOe };

enum class RecordStatus : std::uint8_t {
  kOk,
  kClockWarmingUp,  // mode PT or OE: too few frames since the (re)start to know their times well
  kTimeUnknown,     // the frame may have waited for nobody knows how long (FrameClock)
  kVideoLost,       // no connection to the video source
  kTelemetryLost,  // no connection to the pan/tilt source, and its last angle is too old, or there were fewer than two
  kTelemetryMissing,  // fewer than two usable samples so far
  // The frame lies more than TelemetryLimits::max_extrapolation_s beyond the newest angle that is trusted; by how much
  // says OrientationRecord::telemetry_age_s. What decides it, and which key to change: edge_app/config/README.md.
  kTelemetryTooOld,
  kTelemetryGap,  // the samples around the frame lie too far apart
  kFrameBeforeTelemetry,  // the frame is older than the oldest sample kept, by more than max_extrapolation_s
  kTooFewLandmarks,  // mode PT: too few landmarks held
  kContradiction,    // mode PT: landmarks and telemetry exclude each other
  kBadImage,         // mode PT: no image, or one that is not of the calibration's size
  kImageTooLate,     // mode PT: others waited behind the frame, which went without its image
  kImageRepeated,  // the image is the one before, sent again while the camera turned (RepeatedImages)
  kOtherZoom,      // no calibration for the zoom that the pan/tilt source reports
  kNotFinite,      // a stamp is not a finite number
  kNotLocalized,  // without telemetry: nobody has found yet, or found again, where the camera looks
  kNotCalibrated,  // mode PT: landmarks are not looked for with the data sheet's camera, or a calibration that was withdrawn
  kZoomMoves,  // mode PT: the lens moves, or has just left the zoom curve, and there is no map yet that it could be followed with
  // Mode PT: by the zoom curve the focal length is not known well enough here (zoom_lookup.h) for landmarks to be looked for.
  kFocalLengthUnsure
};

inline constexpr std::array<RecordStatus, 20> kRecordStatuses = {
    RecordStatus::kOk,
    RecordStatus::kClockWarmingUp,
    RecordStatus::kTimeUnknown,
    RecordStatus::kVideoLost,
    RecordStatus::kTelemetryLost,
    RecordStatus::kTelemetryMissing,
    RecordStatus::kTelemetryTooOld,
    RecordStatus::kTelemetryGap,
    RecordStatus::kFrameBeforeTelemetry,
    RecordStatus::kTooFewLandmarks,
    RecordStatus::kContradiction,
    RecordStatus::kBadImage,
    RecordStatus::kImageTooLate,
    RecordStatus::kImageRepeated,
    RecordStatus::kOtherZoom,
    RecordStatus::kNotFinite,
    RecordStatus::kNotLocalized,
    RecordStatus::kNotCalibrated,
    RecordStatus::kZoomMoves,
    RecordStatus::kFocalLengthUnsure};
static_assert(static_cast<std::size_t>(kRecordStatuses.back()) + 1 == kRecordStatuses.size());

// Of a frame whose telemetry was asked for. is_lost: there is no connection to the pan/tilt source. clock_locked: the
// frame's time is known as well as it will be.
[[nodiscard]] RecordStatus status_of_telemetry(QueryStatus query, bool is_lost, bool clock_locked);

// Of a frame for which telemetry has an answer: why the record is telemetry's, if it is; kOk: it is not.
[[nodiscard]] RecordStatus status_of_landmarks(OeStatus landmarks);

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
    case RecordStatus::kTimeUnknown:
      return "picture time unknown";
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
    case RecordStatus::kImageTooLate:
      return "picture too late";
    case RecordStatus::kImageRepeated:
      return "picture repeated";
    case RecordStatus::kOtherZoom:
      return "no calibration for this zoom";
    case RecordStatus::kNotFinite:
      return "not finite";
    case RecordStatus::kNotLocalized:
      return "not localized";
    case RecordStatus::kNotCalibrated:
      return "not calibrated";
    case RecordStatus::kZoomMoves:
      return "zoom moves";
    case RecordStatus::kFocalLengthUnsure:
      return "focal length uncertain";
  }
  return "unknown status";
}

}  // namespace alidade
