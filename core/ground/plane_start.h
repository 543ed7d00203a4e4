#pragma once
// Where the least squares of a plane may begin. Up: as a level or a vertical says, or at right angles to what is seen of the horizon
// and along upright targets, or, where nothing does, any of fourteen directions; about it eight headings, where something can tell
// them apart. Place and height follow linearly from the points, or from one height or length.

#include <vector>

#include "core/ground/plane_solve.h"

namespace alidade::internal {

// The likeliest first, at most `most`.
[[nodiscard]] std::vector<WorldPlane> plane_starts(const PlaneProblem& problem, int most);

}  // namespace alidade::internal
