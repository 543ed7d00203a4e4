#pragma once
// How measured values are distributed: the usual value, and how bad it gets. Values that are not
// finite are ignored.
// Pure; allocates.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <optional>
#include <vector>

namespace alidade {

// All members but `count` in the unit of the values.
struct Spread {
  double median = 0;
  // 1.4826 times the median distance from the median: sigma, if the values are normal.
  double deviation = 0;
  double most = 0;  // 95 % of the values are no larger
  double largest = 0;
  std::size_t count = 0;
};

// Empty if there is no finite value.
[[nodiscard]] inline std::optional<Spread> spread_of(const std::vector<double>& values) {
  std::vector<double> sorted;
  std::copy_if(values.begin(), values.end(), std::back_inserter(sorted),
               [](double value) { return std::isfinite(value); });
  if (sorted.empty()) return std::nullopt;
  std::sort(sorted.begin(), sorted.end());
  const auto at = [](const std::vector<double>& from, double share) {
    return from[static_cast<std::size_t>(
        std::lround(share * static_cast<double>(from.size() - 1)))];
  };
  Spread spread;
  spread.median = at(sorted, 0.5);
  spread.most = at(sorted, 0.95);
  spread.largest = sorted.back();
  spread.count = sorted.size();
  for (double& value : sorted) value = std::abs(value - spread.median);
  std::sort(sorted.begin(), sorted.end());
  spread.deviation = 1.4826 * at(sorted, 0.5);
  return spread;
}

}  // namespace alidade
