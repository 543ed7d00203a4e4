#pragma once
// LatencyHistogram: quantiles of a positive quantity over any length of time, in fixed memory.
// Buckets grow by 5 % from 1 us to beyond 100 s, so a quantile is right to 5 %. Smaller and larger
// values fall into the first and the last bucket. One thread.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace alidade {

class LatencyHistogram {
 public:
  void add(double seconds) {
    const double bucket =
        std::ceil(std::log(std::max(seconds, kLowest) / kLowest) / std::log(kGrowth));
    ++counts_[static_cast<std::size_t>(std::min(bucket, static_cast<double>(kBuckets - 1)))];
    ++total_;
    sum_s_ += seconds;
    longest_s_ = std::max(longest_s_, seconds);
  }

  // Upper edge of the bucket that holds the quantile, s, but no more than the longest value. 0 if
  // nothing was added.
  [[nodiscard]] double quantile(double fraction) const {
    if (total_ == 0) return 0;
    const double wanted = fraction * static_cast<double>(total_);
    std::int64_t seen = 0;
    std::size_t bucket = 0;
    for (; bucket + 1 < kBuckets; ++bucket) {
      seen += counts_[bucket];
      if (static_cast<double>(seen) >= wanted) break;
    }
    return std::min(upper_edge_s(bucket), std::max(longest_s_, kLowest));
  }

  // 0 if nothing was added.
  [[nodiscard]] double longest_s() const { return longest_s_; }
  [[nodiscard]] double sum_s() const { return sum_s_; }
  [[nodiscard]] std::int64_t total() const { return total_; }

  static constexpr std::size_t kBuckets = 384;
  [[nodiscard]] std::int64_t count(std::size_t bucket) const { return counts_[bucket]; }
  // No value in a bucket is longer, except in the last one, which holds all the rest.
  [[nodiscard]] static double upper_edge_s(std::size_t bucket) {
    return kLowest * std::pow(kGrowth, static_cast<double>(bucket));
  }

 private:
  static constexpr double kLowest = 1e-6;
  static constexpr double kGrowth = 1.05;
  std::array<std::int64_t, kBuckets> counts_{};
  std::int64_t total_ = 0;
  double sum_s_ = 0;
  double longest_s_ = 0;
};

}  // namespace alidade
