#pragma once
// How improbable a sum of squares is. No allocation.

namespace alidade::internal {

// Natural logarithm of the probability that chi-square with `freedom` (> 0, not necessarily whole)
// degrees of freedom exceeds `value`. Relative error of the logarithm below 1e-9 where it is below
// -1.
[[nodiscard]] double log_chance(double value, double freedom);

}  // namespace alidade::internal
