#pragma once
// The least covariance that any unbiased estimator can have of the lens and line delay of a simulated camera before a pattern
// (test/core/pattern/pattern_simulation.h): the inverse of the information that all its detections hold, at the truth. Unknown
// are the lens, the line delay, and the motion: the true one plus a cubic B-spline of uniform knots. Everything is
// differentiated numerically through the simulation's own forward model, the row a point is seen in solved anew each time; it
// shares nothing with core/pattern but the types.

#include "core/pattern/lens.h"
#include "test/core/pattern/pattern_simulation.h"

namespace alidade::test {

// data: what simulate_pattern(scene) gave; knots_per_s: of the unknown motion. In LensParameter's units.
[[nodiscard]] LensMatrix pattern_bound(const PatternScene& scene, const PatternData& data,
                                       double knots_per_s);

}  // namespace alidade::test
