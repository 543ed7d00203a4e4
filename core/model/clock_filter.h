#pragma once
// ClockFilter: from jittery arrival times to the times at which a steady clock ticked.
//
//   receive_i = offset + rate * sender_i + delay_i        (host CLOCK_MONOTONIC, seconds)
//
// sender_i is the sender's clock in seconds (RTP, device time; rate = 1 + skew) or a count (V4L2
// sequence; rate = period). The filter estimates the line and answers line(sender_i) with its
// standard deviation. A constant least delay cannot be seen: the line contains it, and so does the
// clock offset d that the visual calibration estimates; hence the line must not step.
//   kOneSided   a packet is never early: Bayesian lower line (lower_line.h) over the lowest item of
//               each time slot of a sliding window.
//   kSymmetric  zero-mean noise: least squares, then a Kalman filter of value and rate; Huber
//               weights; noise level from the data.
// Bad input, in the order in which it is looked for:
//   not finite   rejected: answered by the receive time, or the last answer.
//   wild         sender backwards or receive before the line by restart_gap_s, or after it by ten
//                times that. Rejected, answered from the receive time; the third in a row starts a
//                new line (restarted).
//   floor shift  one-sided only: for settle_s every item stays above the line, or some come before
//                it, by more than floor_shift_s and by a steady amount. Flagged once and subtracted
//                from all later receive times, so the line goes on for as long as it takes; its
//                sigma grows by what the step is uncertain. While warming up, the line moves there.
// Lost items are gaps in sender; repeated and reordered items are answered and teach nothing.
// Fixed memory, trivially copyable, no allocation, no exceptions; one thread. Beyond PTCEE 20, 21.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>

#include "core/model/lower_line.h"

namespace alidade {

enum class ClockJitter {
  kOneSided,  // network or software delay: lower envelope
  kSymmetric  // zero-mean stamp noise: robust line
};

struct ClockFilterOptions {
  ClockJitter jitter = ClockJitter::kOneSided;
  double window_s = 60;               // host time the lower line remembers
  double nominal_period_s = 0;        // of a sequence; 0 = unknown: estimated
  double nominal_period_sigma_s = 0;  // 0 = max_skew * nominal_period_s
  double max_skew = 200e-6;           // |rate - 1| of a sender clock
  double skew_wander = 1.5e-7;        // 1/sqrt(s): random walk of the skew
  double expected_jitter_s = 5e-3;    // first guess, soon outweighed by the data
  double stamp_resolution_s = 1e-6;   // of the stamps, e.g. 1/90000 for RTP
  double floor_shift_s = 1e-3;        // smaller steps of the least delay are followed
  double settle_s = 10;               // time to lock, and to confirm a floor shift
  double restart_gap_s = 1;           // a step of the sender clock that no network explains

  // False and one line in *error (if not null) when a value makes no sense.
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
    require(positive(floor_shift_s), "floor_shift_s must be positive");
    require(positive(settle_s) && settle_s <= window_s, "settle_s must be in (0, window_s]");
    require(positive(restart_gap_s), "restart_gap_s must be positive");
    if (error != nullptr && problem != nullptr) *error = problem;
    return problem == nullptr;
  }
};

// What is known of the rate before the first item: uniform in rate +- half_range.
struct ClockRatePrior {
  double rate;
  double half_range;
};

inline ClockRatePrior sender_rate_prior(const ClockFilterOptions& options) {
  return {1.0, options.max_skew};
}

inline ClockRatePrior sequence_rate_prior(const ClockFilterOptions& options) {
  constexpr double kLongestPeriod = 10;  // s
  const double period = options.nominal_period_s;
  if (!(period > 0)) {
    return {kLongestPeriod / 2, kLongestPeriod / 2};
  }
  return {period, options.nominal_period_sigma_s > 0 ? 4 * options.nominal_period_sigma_s
                                                     : options.max_skew * period};
}

enum class ClockState {
  kWarmingUp,  // usable, sigma_s says how well; the line may still move by more than floor_shift_s
  kLocked      // settle_s of data seen, and sigma_s below floor_shift_s
};

struct ClockEstimate {
  double time_s = 0;   // filtered host time of this item; always finite
  double sigma_s = 0;  // one standard deviation of time_s
  ClockState state = ClockState::kWarmingUp;
  bool rejected = false;   // stamps unusable: time_s comes from the receive time or the last item
  bool restarted = false;  // this item is the first after a restart
  bool floor_shifted = false;  // the least delay stepped; detected at this item; not followed
};

struct ClockCounters {
  std::int64_t items = 0;
  std::int64_t rejected = 0;
  std::int64_t restarts = 0;
  std::int64_t floor_shifts = 0;
};

template <std::size_t Capacity = 256>
class ClockFilter {
  static_assert(Capacity >= 16 && Capacity <= 65535, "time slots of the window");

 public:
  explicit ClockFilter(const ClockFilterOptions& options = {}) : options_(options) {}

  // The next item of a stream with a sender clock.
  ClockEstimate update(double receive_time_s, double sender_time_s) {
    return accept(receive_time_s, sender_time_s, sender_rate_prior(options_));
  }

  // The next item of a counted stream; |sequence| < 2^53.
  ClockEstimate update_sequence(double receive_time_s, std::int64_t sequence) {
    return accept(receive_time_s, static_cast<double>(sequence), sequence_rate_prior(options_));
  }

  // Host time of any sender time (or count), with the line as it is now. 0 before the first item.
  double to_host(double sender) const {
    return started_ ? anchor_receive_ + line_.value_at(sender - anchor_sender_) : 0.0;
  }
  double sigma(double sender) const {
    return started_ ? sigma_at(sender - anchor_sender_) : options_.expected_jitter_s;
  }

  // Seconds of host clock per second of sender clock, less one; or the period of a counted stream.
  double skew() const { return line_.slope - 1; }
  double period_s() const { return line_.slope; }

  // Sum of the floor shifts since the start: what the least delay is now, less what it was.
  double floor_shift_s() const { return shift_; }
  // Receive time of the first item on the floor that the last floor_shifted announced.
  double floor_shift_since_s() const { return shift_since_; }
  // What the shifts so far have made uncertain; contained in every sigma.
  double floor_shift_sigma_s() const { return std::sqrt(shift_variance_); }

  // Mean delay above the least one (one-sided) or sigma of the noise (symmetric).
  double jitter_s() const { return delay_; }

  // For a reconnection that the caller knows of. The next item starts a new line.
  void restart() {
    ++counters_.restarts;
    announce_restart_ = true;
    started_ = false;
    state_ = ClockState::kWarmingUp;
    shift_ = shift_variance_ = 0;
    late_run_ = early_run_ = {};
    young_ = {};
  }

  const ClockCounters& counters() const { return counters_; }
  ClockState state() const { return state_; }

 private:
  static constexpr double kMaxSpan = 1e12;      // beyond it differences of stamps are nonsense
  static constexpr int kWildToRestart = 3;      // in a row
  static constexpr double kHuber = 2.5;         // sigmas
  static constexpr double kGate = 6;            // sigmas no honest item leaves on the early side
  static constexpr double kSameFloor = 20;      // e^-20: odds that chance explains it
  static constexpr double kLeastItems = 3;      // in half a run
  static constexpr double kPriorItems = 2;      // weight of expected_jitter_s
  static constexpr double kNoiseMemory = 1000;  // items
  static constexpr double kYoungItems = 64;

  // Items that may show a floor shift, in halves of settle_s: only when the least residuals of two
  // neighbouring halves agree is the new floor a floor.
  struct Run {
    bool active = false;
    double first = 0;   // receive time of the first item
    double since = 0;   // ... of the older half
    double middle = 0;  // ... of the younger half
    double older = 0;   // least receive - line, s
    double younger = 0;
    // Of the younger half:
    double items = 0;
    double early = 0;
    double sum = 0;

    void add(double receive, double residual, bool is_early) {
      if (!active) {
        active = true;
        first = since = middle = receive;
        older = younger = residual;
      }
      younger = std::min(younger, residual);
      items += 1;
      early += is_early ? 1 : 0;
      sum += residual;
    }
    void begin_half(double receive) {
      since = middle;
      older = younger;
      middle = receive;
      younger = std::numeric_limits<double>::infinity();
      items = early = sum = 0;
    }
    // Standard deviation of the least residual of a half, were its delays exponential.
    double spread() const { return (sum / items - younger) / items; }
  };

  ClockEstimate accept(double receive, double sender, const ClockRatePrior& prior) {
    ++counters_.items;
    if (!std::isfinite(receive) || !std::isfinite(sender)) {
      return reject(std::isfinite(receive) ? receive : last_time_);
    }
    if (!started_) {
      start(receive, sender, prior);
    } else if (is_wild(receive, sender)) {
      if (++wild_ < kWildToRestart) {
        return reject(receive - shift_ - (one_sided() ? delay_ : 0.0));
      }
      restart();
      start(receive, sender, prior);
    }
    wild_ = 0;

    const double x = sender - anchor_sender_;
    const bool newer = x > last_x_;
    const bool shifted =
        one_sided() ? learn_one_sided(receive, x, newer) : learn_symmetric(receive, x, newer);
    last_x_ = std::max(last_x_, x);
    if (newer && state_ == ClockState::kWarmingUp &&
        receive - first_receive_ >= options_.settle_s && sigma_at(x) < options_.floor_shift_s) {
      state_ = ClockState::kLocked;
      locked_since_ = bound_since_ = receive;
    }

    ClockEstimate estimate;
    estimate.time_s = last_time_ = to_host(sender);
    estimate.sigma_s = sigma_at(x);
    estimate.state = state_;
    estimate.restarted = announce_restart_;
    estimate.floor_shifted = shifted;
    announce_restart_ = false;
    return estimate;
  }

  bool one_sided() const { return options_.jitter == ClockJitter::kOneSided; }

  ClockEstimate reject(double time_s) {
    ++counters_.rejected;
    ClockEstimate estimate;
    estimate.time_s = last_time_ = time_s;
    estimate.sigma_s = std::max(delay_, options_.expected_jitter_s);
    estimate.state = state_;
    estimate.rejected = true;
    return estimate;
  }

  void start(double receive, double sender, const ClockRatePrior& prior) {
    started_ = true;
    anchor_receive_ = first_receive_ = receive;
    anchor_sender_ = sender;
    prior_ = prior;
    rate_min_ = prior.rate - prior.half_range;
    rate_max_ = prior.rate + prior.half_range;
    last_x_ = -1;
    delay_ = scale_ = options_.expected_jitter_s;
    line_ = {0, 0, prior.rate, delay_ * delay_, 0, prior.half_range * prior.half_range / 3};
    slots_ = 0;
    slot_width_ = 0;  // at first each item has its own
  }

  bool is_wild(double receive, double sender) const {
    const double x = sender - anchor_sender_;
    const double y = receive - anchor_receive_;
    if (!(std::abs(x) < kMaxSpan && std::abs(y) < kMaxSpan)) {
      return true;
    }
    const double residual = y - shift_ - line_.value_at(x);
    const double gate = std::max(options_.restart_gap_s, kGate * sigma_at(x));
    return (last_x_ - x) * line_.slope > options_.restart_gap_s || residual < -gate ||
           residual > 10 * gate;
  }

  double sigma_at(double x) const {
    const double reach = std::max(0.0, x - last_x_) * line_.slope;
    const double memory = one_sided() && slots_ > 0 ? (x_[slots_ - 1] - x_[0]) * line_.slope : 0.0;
    const double wander = options_.skew_wander * options_.skew_wander *
                          (reach * reach * reach / 3 + memory * memory * memory / 270);
    const double resolution = options_.stamp_resolution_s * options_.stamp_resolution_s / 12;
    return std::sqrt(line_.variance_at(x) + wander + resolution + shift_variance_);
  }

  // ---- one-sided ----

  bool learn_one_sided(double receive, double x, bool newer) {
    const double y = receive - anchor_receive_ - shift_;
    const double residual = y - line_.value_at(x);
    const double gate = std::max(options_.floor_shift_s, kGate * sigma_at(x));
    const bool locked = state_ == ClockState::kLocked;
    const bool early = locked && residual < -gate;
    delay_ += (std::clamp(residual, 0.0, 10 * delay_) - delay_) / 100;

    if (residual < gate) {
      late_run_ = {};
    }
    if (judge(early_run_, receive) || judge(late_run_, receive)) {
      if (newer) {
        insert(receive, x, receive - anchor_receive_ - shift_);
      }
      return true;
    }
    if (residual >= gate) {
      late_run_.add(receive, residual, false);
    }
    if (early && !early_run_.active) {
      slots_ = settled_slots();  // the youngest may belong to the new floor
      slot_since_ = receive - slot_width_;
    }
    if (early || early_run_.active) {
      early_run_.add(receive, residual, early);
    }
    // While a fall of the floor is being judged nothing may pull the line down.
    if (newer && (!early_run_.active || residual >= 0)) {
      insert(receive, x, y);
    }
    if (locked && receive - bound_since_ >= options_.window_s && !late_run_.active &&
        !early_run_.active) {
      bound_since_ = receive;
      bound_rate();
    }
    return false;
  }

  // True if the run has lasted and shows a new floor.
  bool judge(Run& run, double receive) {
    const double half = options_.settle_s / 2;
    if (!run.active || receive - run.middle < half) {
      return false;
    }
    const bool falls = &run == &early_run_;
    if (falls && run.early < 2) {
      run = {};  // a stray outlier
      return false;
    }
    const double spread = std::max(run.spread(), options_.stamp_resolution_s);
    const double step = std::min(run.older, run.younger);
    if (run.middle == run.since || run.items < kLeastItems ||
        std::abs(run.older - run.younger) > kSameFloor * spread ||
        (!falls && step < kSameFloor * spread)) {
      run.begin_half(receive);
      return false;
    }
    const double since = falls ? run.first : run.since;
    late_run_ = early_run_ = {};
    if (state_ != ClockState::kLocked || since < locked_since_) {
      forget_before(since);
      return false;
    }
    step_floor(since, step - spread / 2, spread / 2);
    return true;
  }

  // The true mapping goes on: what changes is the least delay.
  void step_floor(double since, double step, double sigma) {
    const double first = since - anchor_receive_ - shift_;
    for (std::size_t i = 0; i < slots_; ++i) {
      if (y_[i] >= first) {
        y_[i] -= step;
      }
    }
    shift_ += step;
    shift_since_ = since;
    shift_variance_ += sigma * sigma;
    ++counters_.floor_shifts;
  }

  // An early item in the warm-up had dragged the line down: only what came since counts.
  void forget_before(double receive) {
    const double first = receive - anchor_receive_ - shift_;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < slots_; ++i) {
      if (y_[i] >= first || i + 1 == slots_) {
        x_[kept] = x_[i];
        y_[kept++] = y_[i];
      }
    }
    slots_ = kept;
  }

  // Keeps the lowest item of each slot.
  void insert(double receive, double x, double y) {
    if (slots_ > 0 && receive - slot_since_ < slot_width_) {
      const std::size_t last = slots_ - 1;
      if (y - y_[last] >= line_.slope * (x - x_[last])) {
        return;
      }
      x_[last] = x;
      y_[last] = y;
      if (state_ == ClockState::kLocked) {
        return;  // the youngest slot does not count yet
      }
    } else {
      if (slots_ == Capacity) {
        make_room();
      }
      slot_since_ = receive;
      x_[slots_] = x;
      y_[slots_++] = y;
    }
    fit(x);
  }

  // Joins the slots in pairs until they span the window, then drops the oldest.
  void make_room() {
    const double widest = options_.window_s / Capacity;
    if (slot_width_ >= widest) {
      std::copy(x_.begin() + 1, x_.end(), x_.begin());
      std::copy(y_.begin() + 1, y_.end(), y_.begin());
      --slots_;
      return;
    }
    for (std::size_t i = 0; i < Capacity / 2; ++i) {
      const std::size_t a = 2 * i;
      const bool first = y_[a] - line_.value_at(x_[a]) <= y_[a + 1] - line_.value_at(x_[a + 1]);
      x_[i] = x_[first ? a : a + 1];
      y_[i] = y_[first ? a : a + 1];
    }
    slots_ = Capacity / 2;
    slot_width_ = std::min(widest, 2 * (y_[slots_ - 1] - y_[0]) / Capacity);
    scale_ /= 2;
  }

  // Once locked a slot must have aged before it counts: if the floor falls, the items that betray
  // it must not have moved the line.
  std::size_t settled_slots() const {
    std::size_t n = slots_;
    if (state_ == ClockState::kLocked) {
      const double limit = y_[slots_ - 1] - options_.settle_s / 10;
      while (n > 1 && y_[n - 1] > limit) {
        --n;
      }
    }
    return n;
  }

  void fit(double x) {
    const std::size_t n = settled_slots();
    std::array<std::uint16_t, Capacity> hull{};
    line_ = fit_lower_line(x_.data(), y_.data(), n, scale_, rate_min_, rate_max_, x, hull.data());
    std::array<double, Capacity> scratch{};
    scale_ = delay_scale(x_.data(), y_.data(), n, line_, options_.stamp_resolution_s,
                         options_.expected_jitter_s, scratch.data());
  }

  // From now on the rate may leave what the last window said only as far as clocks wander.
  void bound_rate() {
    const double reach = kGate * std::sqrt(line_.var_slope) + 1e-9 * prior_.rate +
                         3 * prior_.rate * options_.skew_wander * std::sqrt(options_.window_s);
    rate_min_ = std::max(prior_.rate - prior_.half_range, line_.slope - reach);
    rate_max_ = std::min(prior_.rate + prior_.half_range, line_.slope + reach);
  }

  // ---- symmetric ----

  // Weighted least squares of the first items: unlike a Kalman filter's their covariance follows
  // the noise level while it is still being learnt.
  struct YoungLine {
    double items = 0;
    double weight = 0, mean_x = 0, mean_y = 0, sxx = 0, sxy = 0;

    void add(double x, double y, double w) {
      weight += w;
      const double dx = x - mean_x;
      mean_x += dx * w / weight;
      mean_y += (y - mean_y) * w / weight;
      sxx += w * dx * (x - mean_x);
      sxy += w * dx * (y - mean_y);
    }
    LineEstimate line(double at, double noise, const ClockRatePrior& prior) const {
      const double ridge = 3 * noise * noise / (prior.half_range * prior.half_range);
      const double slope = (sxy + ridge * prior.rate) / (sxx + ridge);
      const double var_slope = noise * noise / (sxx + ridge);
      const double lever = at - mean_x;
      return {at,
              mean_y + lever * slope,
              slope,
              noise * noise / weight + lever * lever * var_slope,
              lever * var_slope,
              var_slope};
    }
  };

  bool learn_symmetric(double receive, double x, bool newer) {
    if (!newer) {
      return false;
    }
    const double y = receive - anchor_receive_;
    // Time update: the skew walks, and the value with it.
    const double dx = x - line_.x;
    const double walk =
        options_.skew_wander * options_.skew_wander * line_.slope * line_.slope * line_.slope * dx;
    line_.value = line_.value_at(x);
    line_.var_value = line_.variance_at(x) + walk * dx * dx / 3;
    line_.cov_value_slope += line_.var_slope * dx + walk * dx / 2;
    line_.var_slope += walk;
    line_.x = x;

    const double innovation = y - line_.value;
    double weight = 1;
    if (young_.items > 0) {
      const double sigmas = std::abs(innovation) / std::sqrt(line_.var_value + delay_ * delay_);
      // Mean of the logarithm: outliers cannot carry it away. E log|N(0,1)| = -0.635.
      const double log_size = std::log(std::clamp(sigmas, 1e-3, 3.0)) + 0.635;
      const double n = std::min(young_.items, kNoiseMemory);
      delay_ =
          std::max(delay_ * std::exp(log_size / (n + kPriorItems)), options_.stamp_resolution_s);
      weight = sigmas > kHuber ? kHuber / sigmas : 1.0;
    }
    young_.items += 1;
    if (young_.items <= kYoungItems) {
      young_.add(x, y, weight);
      line_ = young_.line(x, delay_, prior_);
      return false;
    }
    const double total = line_.var_value + delay_ * delay_ / weight;
    const double gain_value = line_.var_value / total;
    const double gain_slope = line_.cov_value_slope / total;
    line_.value += gain_value * innovation;
    line_.slope += gain_slope * innovation;
    line_.var_slope = std::max(0.0, line_.var_slope - gain_slope * line_.cov_value_slope);
    line_.cov_value_slope *= 1 - gain_value;
    line_.var_value *= 1 - gain_value;
    return false;
  }

  ClockFilterOptions options_;
  ClockCounters counters_;
  ClockState state_ = ClockState::kWarmingUp;
  bool started_ = false;
  bool announce_restart_ = false;
  int wild_ = 0;
  double last_time_ = 0;

  // The line in seconds since the anchors, so that a double resolves far below a microsecond.
  double anchor_receive_ = 0;
  double anchor_sender_ = 0;
  double first_receive_ = 0;
  double last_x_ = 0;
  LineEstimate line_;
  ClockRatePrior prior_{1, 0};
  double delay_ = 0;  // typical delay (one-sided) or noise sigma (symmetric), s

  double shift_ = 0;
  double shift_variance_ = 0;
  double shift_since_ = 0;
  Run late_run_;
  Run early_run_;

  // Lowest item of each time slot, oldest first.
  std::array<double, Capacity> x_{};
  std::array<double, Capacity> y_{};
  std::size_t slots_ = 0;
  double slot_width_ = 0;
  double slot_since_ = 0;
  double scale_ = 0;  // of the slots' residuals
  double rate_min_ = 0;
  double rate_max_ = 0;
  double bound_since_ = 0;
  double locked_since_ = 0;
  YoungLine young_;
};

static_assert(std::is_trivially_copyable_v<ClockFilter<>>,
              "copied through queues, never allocates");

}  // namespace alidade
