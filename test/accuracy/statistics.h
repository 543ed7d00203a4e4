#pragma once
// Plain statistics of Monte-Carlo runs. Sums of squared standardised Gaussian errors follow the
// chi-square distribution: that is where every interval here comes from. Pure.

#include <vector>

namespace alidade::test {

struct Interval {
  double low = 0;
  double high = 0;
  [[nodiscard]] bool contains(double x) const { return x >= low && x <= high; }
};

[[nodiscard]] double mean(const std::vector<double>& values);
[[nodiscard]] double median(std::vector<double> values);
[[nodiscard]] double largest(const std::vector<double>& values);
[[nodiscard]] double root_mean_square(const std::vector<double>& values);
// Pearson's; 0 when one of them does not vary.
[[nodiscard]] double correlation(const std::vector<double>& a, const std::vector<double>& b);

// Where the mean of this many squared standard normal numbers lies with this probability.
[[nodiscard]] Interval mean_square_interval(int count, double probability);
// Likewise the root of that mean.
[[nodiscard]] Interval root_mean_square_interval(int count, double probability);

}  // namespace alidade::test
