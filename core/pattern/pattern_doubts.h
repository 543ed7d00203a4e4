#pragma once
// doubts_of(): what detections show of a video that makes a calibration worse or fail: gaps without
// the pattern, and a second pattern in view. One line each, for a person. Expects steady times,
// observations ordered by point, and half turns undone (follow_half_turns()). Pure; allocates.

#include <string>
#include <vector>

#include "core/pattern/pattern_data.h"

namespace alidade {

[[nodiscard]] std::vector<std::string> doubts_of(const PatternData& data);

}  // namespace alidade
