#include "edge_app/tracking/target_state.h"
#include "platform/system/text.h"

namespace alidade {

std::vector<TargetCounters::BoxCount> TargetCounters::boxes() const {
  std::vector<BoxCount> out = {
      {"taken", "taken", boxes_taken},
      {"below_score", "below tracking.least_score", boxes_below_score},
      {"cut_off", "the picture's lower edge cuts it off", boxes_cut_off},
      {"without_place", "its foot is not below the horizon, or too near to it",
       boxes_without_place}};
  for (int i = 0; i < kBoxFaultCount; ++i) {
    const auto fault = static_cast<BoxFault>(i);
    out.push_back({label_of(fault), to_string(fault), of(fault)});
  }
  return out;
}

std::string detections_text(const TargetCounters& counters) {
  const std::int64_t late = counters.of(DetectionStatus::kTakenLate);
  std::string text =
      counted(counters.of(DetectionStatus::kTaken) + late, "frame") + " of detections";
  if (late > 0) text += " (" + std::to_string(late) + " late)";
  for (int i = 0; i < kDetectionStatusCount; ++i) {
    const auto status = static_cast<DetectionStatus>(i);
    if (is_taken(status) || counters.of(status) == 0) continue;
    text += ", " + std::to_string(counters.of(status)) + " refused (" + to_string(status) + ")";
  }
  const char* before = "; boxes left out: ";
  for (const auto& outcome : counters.boxes()) {
    if (outcome.label == std::string("taken") || outcome.boxes == 0) continue;
    text += before + std::to_string(outcome.boxes) + " (" + outcome.words + ")";
    before = ", ";
  }
  return text;
}

}  // namespace alidade
