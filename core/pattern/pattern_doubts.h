#pragma once
// What detections show of a video that makes a calibration worse or fail, as lines for a person: stretches without the pattern, and
// a second pattern in view. Detections are those of steady times, half turns undone. Pure; allocates.

#include <string>
#include <vector>

#include "core/pattern/pattern_data.h"

namespace alidade {

[[nodiscard]] std::vector<std::string> doubts_of(const PatternData& data);

}  // namespace alidade
