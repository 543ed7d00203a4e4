#pragma once
// What the residuals say of the likeliest causes why a recording does not obey the model: score
// tests (departure_score.h) of linear departures, each with its signature.
//   telemetry: a function of either axis's angle (gear), its direction of motion (play), its speed
//     (one axis late)
//   pictures: the focal length over time, r^5 distortion, the optical centre, a lag that depends on
//     speed, parallax (a pupil away from the axes, and depth), a drift of part of the scene
// Greedy: the most improbable one, then what is improbable beside it. None is named where nothing
// is beyond chance, at 1 % for all together. Derivation: docs/calibration.md. Allocates.

#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/calibration_types.h"

namespace alidade::internal {

struct Departures {
  std::vector<CalibrationCause> causes;       // the likeliest first
  GlobalMatrix error = GlobalMatrix::Zero();  // squares of what they do to the parameters
};

[[nodiscard]] Departures find_departures(const Adjustment& adjustment, const AdjustmentState& state,
                                         const Linearisation& at, const ReducedFactor& factor);

}  // namespace alidade::internal
