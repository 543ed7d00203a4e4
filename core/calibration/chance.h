#pragma once
// How improbable a sum of squares is by chance. No allocation.

namespace alidade::internal {

// Natural logarithm of the probability that chi-square with `freedom` degrees of freedom (> 0, any
// real number) exceeds `value`; 0 if value <= 0. Below -1 its relative error is less than 1e-9.
[[nodiscard]] double log_chance(double value, double freedom);

}  // namespace alidade::internal
