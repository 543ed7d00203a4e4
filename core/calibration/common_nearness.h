#pragma once
// What all that is in view has in common of nu = o / r, o the pupil's place before the axes, r the
// distance: the picture is that of a lens with a longer focal length, log f += nu, and no residual
// shows it. A stated scene and pupil tell it, and what differs from landmark to landmark, which
// the pictures show. Allocates. Derivation: docs/calibration.md.

#include <optional>
#include <string>

#include "core/calibration/adjustment.h"
#include "core/calibration/calibration_types.h"
#include "core/calibration/depth_spread.h"
#include "core/calibration/linearisation.h"

namespace alidade::internal {

// spread: standard deviation of nu over the landmarks, as the pictures show it; 0: they show none.
// Without a scene the value is 0 and the sigma two spreads.
[[nodiscard]] Nearness common_nearness(const Pupil& pupil,
                                       const std::optional<SceneDistance>& scene, double spread);

// What is wrong with a stated scene, and what would be right; empty: nothing. shown: by the
// pictures.
[[nodiscard]] std::string scene_problem(const Pupil& pupil, const SceneDistance& scene,
                                        const DepthSpread& shown);

// The part of the parameters' covariance that the prior of the mean nearness alone decides, as no
// residual shows it. It is what holding that mean takes away. state: with nearness. at: the minimum
// of least squares. Zero if it cannot be told.
[[nodiscard]] GlobalMatrix part_of_mean_nearness(const AdjustmentState& state,
                                                 const Linearisation& at, double nearness_sigma,
                                                 Adjustment* adjustment);

}  // namespace alidade::internal
