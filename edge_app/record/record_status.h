#pragma once
// RecordMode and RecordStatus: how a record's orientation was found, and why it is not better or
// missing. A status comes from one of:
//   TelemetryBuffer::query()  where the frame's time lies relative to the telemetry samples
//                             (QueryStatus)
//   OeMode::process()         whether landmarks held (OeStatus), if telemetry has an answer for the
//                             frame
//   FrameClock                whether the frame's time is known
//   OrientationStep           no calibration, zoom, video lost, repeated images (RepeatedImages),
//                             not localized (SceneStart)
//   RealtimeStage             images too late to be looked at
// If OE mode is asked for, kOk occurs in mode OE only. What each status means to a user, and what
// to do: docs/manual/reference/statuses.md.

#include <array>
#include <cstddef>
#include <cstdint>

namespace alidade {

enum class OeStatus;
enum class QueryStatus;

enum class RecordMode : std::uint8_t { kNone, kPt, kOe };

enum class RecordStatus : std::uint8_t {
  kOk,
  kClockWarmingUp,  // mode PT or OE: too few frames since the (re)start to know the time well
  kTimeUnknown,     // the frame may have waited for an unknown time (FrameClock)
  kVideoLost,       // no connection to the video source
  // No connection to the pan/tilt source; its last angle is too old, or there were fewer than two.
  kTelemetryLost,
  kTelemetryMissing,  // fewer than two usable samples so far
  // The frame lies more than TelemetryLimits::max_extrapolation_s beyond the newest trusted angle;
  // OrientationRecord::telemetry_age_s says how far. The causes, and which key to change:
  // docs/manual/reference/statuses.md.
  kTelemetryTooOld,
  kTelemetryGap,          // the samples around the frame lie too far apart
  kFrameBeforeTelemetry,  // older than the oldest sample kept by more than max_extrapolation_s
  kTooFewLandmarks,       // mode PT: too few landmarks held
  kContradiction,         // mode PT: landmarks and telemetry exclude each other
  kSceneMoves,            // mode PT: what is in view moves, or it is not known which part moves
  kBadImage,              // mode PT: no image, or not of the calibration's size
  kImageTooLate,          // mode PT: other frames waited behind this one, so it lost its image
  kImageRepeated,  // the image before was sent again while the camera turned (RepeatedImages)
  kOtherZoom,      // no calibration for the zoom that the pan/tilt source reports
  kNotFinite,      // a stamp or an angle, or what follows from them, is not a finite number
  kNotLocalized,   // without telemetry: where the camera looks is not known, or no longer known
  kNotCalibrated,  // mode PT: no calibration, or a withdrawn one: landmarks are not looked for
  kZoomMoves,  // mode PT: the lens moves, or has just left the zoom curve; no map to follow it with
  // Mode PT: the zoom curve does not know the focal length well enough here for landmarks to be
  // looked for (zoom_lookup.h).
  kFocalLengthUnsure,
  kCount
};

inline constexpr auto kRecordStatusCount = static_cast<std::size_t>(RecordStatus::kCount);

constexpr std::array<RecordStatus, kRecordStatusCount> all_record_statuses() {
  std::array<RecordStatus, kRecordStatusCount> all{};
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<RecordStatus>(i);
  return all;
}
inline constexpr std::array<RecordStatus, kRecordStatusCount> kRecordStatuses =
    all_record_statuses();

// For a frame whose telemetry was queried. is_lost: there is no connection to the pan/tilt source.
// clock_locked: the frame's time is known as well as it will be.
[[nodiscard]] RecordStatus status_of_telemetry(QueryStatus query, bool is_lost, bool clock_locked);

// For a frame for which telemetry has an answer: why the record is telemetry's. kOk: it is not.
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
    case RecordStatus::kSceneMoves:
      return "scene moves";
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
    case RecordStatus::kCount:
      break;
  }
  return "unknown status";
}

}  // namespace alidade
