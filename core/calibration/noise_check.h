#pragma once
// Do the residuals agree with the stated noise? Derivations: docs/calibration.md. Allocates.

#include <cstddef>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

// Residual over stated noise.
struct NoiseRatio {
  double ratio = 1;       // root mean square, redundancy accounted for
  double redundancy = 0;  // degrees of freedom behind the ratio

  // Whether ratio^2 differs from 1 by more than 4 of its standard deviations, sqrt(2 / redundancy).
  // redundancy must be > 0.
  [[nodiscard]] bool contradicts() const;
};

struct NoiseRatios {
  NoiseRatio pixel;
  NoiseRatio telemetry;

  // Whether there is enough redundancy of both.
  [[nodiscard]] bool known() const { return pixel.redundancy >= 10 && telemetry.redundancy >= 10; }
};

// Size of the residuals against the stated noise. m residuals with n unknowns leave m - n degrees
// of freedom (Helmert). telemetry_unknowns: the number of unknowns that telemetry determines,
// trace(H^-1 H_telemetry) (Adjustment::covariance()); the observations determine the others. at:
// the minimum of least squares.
[[nodiscard]] NoiseRatios noise_ratios(const AdjustmentData& data, const AdjustmentState& state,
                                       const Linearisation& at, double telemetry_unknowns);

// How many observations of a landmark in neighbouring frames count as one: 1 + 2 sum of the
// correlations of their errors, up to the first negligible one. About 1 for independent errors.
// Errors repeat if a patch looks different in another light or moves across another part of the
// lens; they then average out less than the count of observations says. landmarks: their number.
// at: the minimum of least squares.
[[nodiscard]] double repetition(const AdjustmentData& data, std::size_t landmarks,
                                const Linearisation& at);

}  // namespace alidade::internal
