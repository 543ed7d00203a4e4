#pragma once
// Starts for the least squares of a plane. Up comes from a level or a vertical; or it is at right
// angles to the horizon's directions and to the planes of upright targets; or it is one of fourteen
// directions. About each up there is one heading, if it is given or the base defines it, else
// there are eight. Place and height follow linearly from the points, or from heights and lengths.
// Allocates.

#include <vector>

#include "core/ground/plane_solve.h"

namespace alidade::internal {

// The most likely starts first, at most `most`.
[[nodiscard]] std::vector<WorldPlane> plane_starts(const PlaneProblem& problem, int most);

}  // namespace alidade::internal
