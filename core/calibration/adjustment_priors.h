#pragma once
// Prior knowledge in the adjustment's scaled parameters (linearisation.h): the options' priors, and
// a prior of the drift between the clocks, from the sigmas of their periods. The drift is fixed at
// 0 unless both clocks are steady. The clock offset's prior also has the variance of the stamps.

#include <array>

#include "core/calibration/calibration_types.h"
#include "core/calibration/linearisation.h"
#include "core/calibration/recording_clocks.h"

namespace alidade::internal {

struct PriorKnowledge {
  AdjustmentPriors priors;
  std::array<bool, kGlobalCount> fixed{};  // known exactly; by index in GlobalVector
};

// width, height: of the image, px. focal_length (px): the mean if the options have no prior of the
// focal length. options: valid.
[[nodiscard]] PriorKnowledge prior_knowledge(int width, int height,
                                             const CalibrationOptions& options,
                                             const RecordingClocks& clocks, double focal_length);

}  // namespace alidade::internal
