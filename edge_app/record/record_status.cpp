#include "edge_app/record/record_status.h"

#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/telemetry/telemetry_buffer.h"

namespace alidade {

RecordStatus status_of_telemetry(QueryStatus query, bool is_lost, bool clock_locked) {
  switch (query) {
    case QueryStatus::kOk:
    case QueryStatus::kExtrapolated:
      return clock_locked ? RecordStatus::kOk : RecordStatus::kClockWarmingUp;
    case QueryStatus::kEmpty:
    case QueryStatus::kOneSample:
      return is_lost ? RecordStatus::kTelemetryLost : RecordStatus::kTelemetryMissing;
    case QueryStatus::kTelemetryTooOld:
      return is_lost ? RecordStatus::kTelemetryLost : RecordStatus::kTelemetryTooOld;
    case QueryStatus::kBeforeTelemetry:
      return RecordStatus::kFrameBeforeTelemetry;
    case QueryStatus::kGap:
      return RecordStatus::kTelemetryGap;
    case QueryStatus::kNotFinite:
      break;
  }
  return RecordStatus::kNotFinite;
}

RecordStatus status_of_landmarks(OeStatus landmarks) {
  switch (landmarks) {
    case OeStatus::kOk:
      return RecordStatus::kOk;
    case OeStatus::kTooFew:
      return RecordStatus::kTooFewLandmarks;
    case OeStatus::kContradiction:
      return RecordStatus::kContradiction;
    case OeStatus::kSceneMoves:
      return RecordStatus::kSceneMoves;
    case OeStatus::kBadImage:
      return RecordStatus::kBadImage;
    case OeStatus::kLensMoves:
      return RecordStatus::kZoomMoves;
    case OeStatus::kNoPrediction:
    case OeStatus::kNotFinite:
      break;
  }
  return RecordStatus::kNotFinite;
}

}  // namespace alidade
