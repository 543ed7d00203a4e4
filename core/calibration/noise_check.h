#pragma once
// Do the residuals agree with the noise that was stated? Two looks at them:
//   noise_ratios   how large they are against it, redundancy accounted for: of m residuals with n unknowns among them
//                  m - n degrees of freedom remain (Helmert). The unknowns are shared out: telemetry decides
//                  trace(H^-1 H_telemetry) of them, the observations the rest.
//   repetition     whether a landmark errs alike in neighbouring frames (a patch that looks different in another
//                  light, or is moved across another part of the lens): such errors are averaged less than the
//                  count of observations says.
// Derivations: docs/calibration.md. Allocates.

#include <cstddef>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

// Residual over stated noise, and the degrees of freedom that say so.
struct NoiseRatio {
  double ratio = 1;
  double redundancy = 0;

  // Beyond chance: ratio^2 has a standard deviation of sqrt(2 / redundancy).
  [[nodiscard]] bool contradicts() const;
};

struct NoiseRatios {
  NoiseRatio pixel;
  NoiseRatio telemetry;

  // Enough of both to tell.
  [[nodiscard]] bool known() const { return pixel.redundancy >= 10 && telemetry.redundancy >= 10; }
};

// Of a linearisation at the minimum of least squares; telemetry_unknowns by Adjustment::covariance().
[[nodiscard]] NoiseRatios noise_ratios(const AdjustmentData& data, const AdjustmentState& state,
                                       const Linearisation& at, double telemetry_unknowns);

// How many observations of a landmark in neighbouring frames are worth one: 1 + 2 sum of the correlations of their
// errors, as long as there are any; about 1 if they are independent. landmarks: how many there are.
[[nodiscard]] double repetition(const AdjustmentData& data, std::size_t landmarks,
                                const Linearisation& at);

}  // namespace alidade::internal
