#pragma once
// Nearness that all things in view have in common: nu = o / r, o the pupil's offset forward of the
// axes, r the distance. It has the effect of a longer focal length, log f += nu, and no residual
// shows it. It is estimated from a stated scene and pupil, and from the spread of nu over the
// landmarks, which the pictures show. Allocates. Derivation: docs/calibration.md.

#include <optional>
#include <string>

#include "core/calibration/adjustment.h"
#include "core/calibration/calibration_types.h"
#include "core/calibration/depth_spread.h"
#include "core/calibration/linearisation.h"

namespace alidade::internal {

// spread: standard deviation of nu over the landmarks, as the pictures show it; 0: they show none.
// Without a scene the value is 0 and the sigma two spreads. scene: valid (CalibrationOptions).
[[nodiscard]] Nearness common_nearness(const Pupil& pupil,
                                       const std::optional<SceneDistance>& scene, double spread);

// What is wrong with a stated scene, and what would be right; empty: nothing. It is wrong if pupil
// and scene, at three sigmas, cannot make the spread `shown`, which the pictures show.
[[nodiscard]] std::string scene_problem(const Pupil& pupil, const SceneDistance& scene,
                                        const DepthSpread& shown);

// The part of the parameters' covariance that comes from the mean of all nearness, which only its
// prior decides, as no residual shows it. To be subtracted: then that mean is held. state: with
// nearness, of which each has this sigma as prior. at: the minimum of least squares. Zero if the
// normal equations have no solution.
[[nodiscard]] GlobalMatrix part_of_mean_nearness(const AdjustmentState& state,
                                                 const Linearisation& at, double nearness_sigma,
                                                 Adjustment* adjustment);

}  // namespace alidade::internal
