#pragma once
// In double: the unit of what rounding may add to a number near 1.

#include <limits>

namespace alidade::test {

inline constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

}  // namespace alidade::test
