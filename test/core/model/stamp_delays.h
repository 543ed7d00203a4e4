#pragma once
// How late a stream's stamps are, as the tests of clocks draw it: seconds, by the sender's time.

#include <functional>
#include <random>

#include "core/model/clock_filter.h"

namespace alidade::test {

using Random = std::mt19937_64;
using Delay = std::function<double(Random&, double)>;

inline Delay exponential(double mean_s) {
  return [mean_s](Random& random, double) {
    return std::exponential_distribution<double>(1 / mean_s)(random);
  };
}

inline Delay gaussian(double sigma_s) {
  return [sigma_s](Random& random, double) {
    return std::normal_distribution<double>(0, sigma_s)(random);
  };
}

inline ClockFilterOptions symmetric() {
  ClockFilterOptions options;
  options.jitter = ClockJitter::kSymmetric;
  return options;
}

}  // namespace alidade::test
