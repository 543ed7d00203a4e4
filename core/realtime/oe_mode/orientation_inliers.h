#pragma once
// Which landmarks of a frame agree on a motion. Two steps:
//   robust_start()   starts at the median of the angles that each landmark alone gives; then
//                    weights fall with the residual, while the scale shrinks to that of the
//                    residuals
//   gate()           landmarks within the gate count fully, the others not at all
// Internal to orientation_solve.cpp. No allocation.

#include <array>

#include "core/realtime/oe_mode/orientation_problem.h"

namespace alidade::internal {

// Least number of landmarks for 6 unknowns, whatever the limits say.
inline constexpr int kMinInliers = 3;

// By landmark.
using Squares = std::array<double, kMaxFoundLandmarks>;  // residuals, normalised by covariance
using Weights = std::array<double, kMaxFoundLandmarks>;  // 0 to 1

struct Fit {
  MotionAndLens x;
  Squares squares;          // at x
  Weights weights;          // as last used
  double scale_square = 1;  // factor for the landmarks' covariances
  int inliers = 0;          // by gate()
};

void find_squares(const OrientationProblem& problem, const MotionAndLens& x, Squares* out);

// False if the result is not finite.
[[nodiscard]] bool robust_start(const OrientationProblem& problem, const MotionPrior& prior,
                                const ScaledPrior& scaled, double unit_s, const SolveLimits& limits,
                                const FoundLandmark* landmarks, Fit* fit);
// Sets the landmarks' `inlier`. False if too few are.
[[nodiscard]] bool gate(const OrientationProblem& problem, const ScaledPrior& scaled,
                        const SolveLimits& limits, FoundLandmark* landmarks, Fit* fit);

// Factor for the landmarks' covariances: by how much the squares of residuals averaged over
// neighbours exceed what independent errors leave. About 1 if the errors are independent; 1 if too
// few neighbourhoods have landmarks. width, height: px, of the image.
[[nodiscard]] double neighbours_inflation(const OrientationProblem& problem,
                                          const FoundLandmark* landmarks, double width,
                                          double height, const MotionAndLens& x);

}  // namespace alidade::internal
