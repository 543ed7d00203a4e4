#pragma once

#include <limits>

namespace alidade {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

}  // namespace alidade
