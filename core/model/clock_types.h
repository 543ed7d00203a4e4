#pragma once
// Input and output of the clock filters: options, prior of a clock's rate, answer for one item.
// Plain structs. All times are seconds of the host's clock.

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
  double nominal_period_s = 0;        // of a sequence; 0: unknown, estimated
  double nominal_period_sigma_s = 0;  // prior: +-4 of these; 0: +-max_skew * nominal_period_s
  double max_skew = 200e-6;           // |rate - 1| of a sender clock
  double skew_wander = 1.5e-7;        // 1/sqrt(s): random walk of the skew
  double expected_jitter_s = 5e-3;    // first guess, soon outweighed by the data
  double stamp_resolution_s = 1e-6;   // of the stamps, such as 1/90000 for RTP
  double min_delay_step_s = 1e-3;     // the line follows smaller steps of the minimum delay
  double settle_s = 10;               // until lock, and to confirm a step of the minimum delay
  double restart_gap_s = 1;           // step of the sender clock that no network explains

  // False if a value is out of range. *error, if not null, then says which in one line.
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

// Prior of the rate: uniform in rate +- half_range. Host seconds per sender second or per count.
struct ClockRatePrior {
  double rate;
  double half_range;
};

inline ClockRatePrior sender_rate_prior(const ClockFilterOptions& options) {
  return {1.0, options.max_skew};
}

// Without a nominal period: 0 to kLongestPeriod_s.
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
  kWarmingUp,  // usable; the line may still move by more than min_delay_step_s
  kLocked      // since settle_s of data gave sigma_s below min_delay_step_s; until a restart
};

struct ClockEstimate {
  double time_s = 0;   // filtered host time of this item; always finite
  double sigma_s = 0;  // one standard deviation of time_s
  ClockState state = ClockState::kWarmingUp;
  bool rejected = false;       // stamps unusable: time_s is from the receive time or last item
  bool restarted = false;      // this item is the first of a new line after a restart
  bool delay_stepped = false;  // this item proves a step of the minimum delay; not followed
};

struct ClockCounters {
  std::int64_t items = 0;
  std::int64_t rejected = 0;
  std::int64_t restarts = 0;
  std::int64_t delay_steps = 0;  // of the minimum delay
};

namespace internal {

// One item relative to the first item of the line, so that a double resolves far below a
// microsecond.
struct ClockItem {
  double receive_s;  // as stamped
  double x;          // sender seconds, or counts
  double y;          // host seconds
  double sigma_s;    // of the line at x, before this item
  bool newer;        // x is beyond all earlier ones; other items do not update the line
};

}  // namespace internal

}  // namespace alidade
