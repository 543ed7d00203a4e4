#pragma once
// Prior knowledge in the adjustment's scaled parameters (linearisation.h): the options' priors, and
// the drift between the clocks, which the precision of their periods bounds.

#include <array>

#include "core/calibration/calibration_types.h"
#include "core/calibration/linearisation.h"
#include "core/calibration/recording_clocks.h"

namespace alidade::internal {

struct PriorKnowledge {
  AdjustmentPriors priors;
  std::array<bool, kGlobalCount> fixed{};  // known exactly
};

// focal_length (px): mean of the focal length if the options have no prior of it.
[[nodiscard]] PriorKnowledge prior_knowledge(int width, int height,
                                             const CalibrationOptions& options,
                                             const RecordingClocks& clocks, double focal_length);

}  // namespace alidade::internal
