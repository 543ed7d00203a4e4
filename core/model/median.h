#pragma once
// median(): of an even number of values, the upper one of the two in the middle. values must not be
// empty. Allocates.

#include <algorithm>
#include <cstddef>
#include <vector>

namespace alidade {

[[nodiscard]] inline double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace alidade
