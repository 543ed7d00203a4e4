#pragma once
// What the clock filters take and give: options, the prior of a clock's rate, the answer for one item.
// Plain structs; all times are seconds of the host's clock.

#include <cmath>
#include <cstdint>

namespace alidade {

enum class ClockJitter {
  kOneSided,  // network or software delay: never early
  kSymmetric  // zero-mean stamp noise
};

struct ClockFilterOptions {
  ClockJitter jitter = ClockJitter::kOneSided;
  double window_s = 60;               // host time that the line of kOneSided remembers
  double nominal_period_s = 0;        // of a sequence; 0 = unknown: estimated
  double nominal_period_sigma_s = 0;  // 0 = max_skew * nominal_period_s
  double max_skew = 200e-6;           // |rate - 1| of a sender clock
  double skew_wander = 1.5e-7;        // 1/sqrt(s): random walk of the skew
  double expected_jitter_s = 5e-3;    // first guess, soon outweighed by the data
  double stamp_resolution_s = 1e-6;   // of the stamps, e.g. 1/90000 for RTP
  double min_delay_step_s = 1e-3;     // smaller steps of the minimum delay are followed
  double settle_s = 10;               // time to lock, and to confirm a step of the minimum delay
  double restart_gap_s = 1;           // a step of the sender clock that no network explains

  // False and one line in *error (if not null) when a value is out of its range.
  [[nodiscard]] bool validate(const char** error = nullptr) const {
    const auto positive = [](double v) { return std::isfinite(v) && v > 0; };
    const auto not_negative = [](double v) { return std::isfinite(v) && v >= 0; };
    const char* problem = nullptr;
    const auto require = [&problem](bool ok, const char* what) {
      problem = problem == nullptr && !ok ? what : problem;
    };
    require(positive(window_s), "window_s must be positive");
    require(not_negative(nominal_period_s), "nominal_period_s must not be negative");
    require(not_negative(nominal_period_sigma_s), "nominal_period_sigma_s must not be negative");
    require(positive(max_skew) && max_skew < 0.5, "max_skew must be in (0, 0.5)");
    require(not_negative(skew_wander), "skew_wander must not be negative");
    require(positive(expected_jitter_s), "expected_jitter_s must be positive");
    require(positive(stamp_resolution_s), "stamp_resolution_s must be positive");
    require(positive(min_delay_step_s), "min_delay_step_s must be positive");
    require(positive(settle_s) && settle_s <= window_s, "settle_s must be in (0, window_s]");
    require(positive(restart_gap_s), "restart_gap_s must be positive");
    if (error != nullptr && problem != nullptr) *error = problem;
    return problem == nullptr;
  }
};

// What is known of the rate before the first item: uniform in rate +- half_range. Host seconds per sender
// second, or per count.
struct ClockRatePrior {
  double rate;
  double half_range;
};

inline ClockRatePrior sender_rate_prior(const ClockFilterOptions& options) {
  return {1.0, options.max_skew};
}

inline ClockRatePrior sequence_rate_prior(const ClockFilterOptions& options) {
  constexpr double kLongestPeriod_s = 10;
  const double period = options.nominal_period_s;
  if (!(period > 0)) {
    return {kLongestPeriod_s / 2, kLongestPeriod_s / 2};
  }
  return {period, options.nominal_period_sigma_s > 0 ? 4 * options.nominal_period_sigma_s
                                                     : options.max_skew * period};
}

enum class ClockState {
  kWarmingUp,  // usable, sigma_s says how well; the line may still move by more than min_delay_step_s
  kLocked      // settle_s of data seen, and sigma_s below min_delay_step_s
};

struct ClockEstimate {
  double time_s = 0;   // filtered host time of this item; always finite
  double sigma_s = 0;  // one standard deviation of time_s
  ClockState state = ClockState::kWarmingUp;
  bool rejected = false;   // stamps unusable: time_s comes from the receive time or the last item
  bool restarted = false;  // this item is the first after a restart
  bool delay_stepped = false;  // this item proves that the minimum delay stepped; not followed
};

struct ClockCounters {
  std::int64_t items = 0;
  std::int64_t rejected = 0;
  std::int64_t restarts = 0;
  std::int64_t delay_steps = 0;  // of the minimum delay
};

namespace internal {

// One item as a line sees it: relative to the item the line began with, so that a double resolves far below
// a microsecond.
struct ClockItem {
  double receive_s;  // as stamped
  double x;          // sender seconds, or counts
  double y;          // host seconds
  double sigma_s;    // of the line at x, before this item
  bool newer;        // x is beyond all before it; others teach nothing
};

}  // namespace internal

}  // namespace alidade
