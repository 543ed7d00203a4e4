#pragma once
// ClockFilter: from jittery arrival times to the times at which a steady clock ticked.
//
//   receive_i = offset + rate * sender_i + delay_i        (host CLOCK_MONOTONIC, seconds)
//
// sender_i is the sender's clock in seconds (RTP, device time; rate = 1 + skew) or a count (V4L2
// sequence; rate = period). The filter estimates the line and answers line(sender_i) with its
// standard deviation. A constant least delay cannot be seen: the line contains it, and so does the
// clock offset d that the visual calibration estimates; hence the line must not step.
//   kOneSided   delay >= 0 (a packet is never early): Bayesian lower line (lower_line.h) over the
//               lowest item of each time slot of a sliding window.
//   kSymmetric  zero-mean noise: Kalman filter of (offset, rate), Huber weights, noise level from
//   the data.
// Behaviour, in the order in which it is checked for each item:
//   non-finite                   rejected; answered from the line or the receive time.
//   wild: sender backwards or receive earlier than the line by restart_gap_s, or later than it by
//   ten times that                   rejected; the third in a row restarts the filter (restarted =
//   true). floor shift (one-sided, locked): for settle_s no item comes near the line, or many come
//   too early, by more than floor_shift_s   flagged ONCE, and subtracted from all later receive
//   times: the line
//                                goes on as before. While warming up the line moves there instead.
// Lost items are gaps in sender; late duplicates and reordered items are answered but teach
// nothing. Fixed memory, trivially copyable, no exceptions. One thread. Goes beyond PTCEE 20-21.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
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
  double skew_wander = 1e-7;          // 1/sqrt(s): random walk of the skew
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
    if (!positive(window_s)) problem = "window_s must be positive";
    if (!not_negative(nominal_period_s)) problem = "nominal_period_s must not be negative";
    if (!not_negative(nominal_period_sigma_s)) {
      problem = "nominal_period_sigma_s must not be negative";
    }
    if (!positive(max_skew) || max_skew >= 0.5) problem = "max_skew must be in (0, 0.5)";
    if (!not_negative(skew_wander)) problem = "skew_wander must not be negative";
    if (!positive(expected_jitter_s)) problem = "expected_jitter_s must be positive";
    if (!positive(stamp_resolution_s)) problem = "stamp_resolution_s must be positive";
    if (!positive(floor_shift_s)) problem = "floor_shift_s must be positive";
    if (!positive(settle_s) || settle_s > window_s) problem = "settle_s must be in (0, window_s]";
    if (!positive(restart_gap_s)) problem = "restart_gap_s must be positive";
    if (error != nullptr && problem != nullptr) *error = problem;
    return problem == nullptr;
  }
};

enum class ClockState {
  kWarmingUp,  // usable, sigma_s says how well; the line may still move by more than floor_shift_s
  kLocked      // settle_s of data seen
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
    return accept(receive_time_s, sender_time_s, 1.0, options_.max_skew);
  }

  // The next item of a counted stream.
  ClockEstimate update_sequence(double receive_time_s, std::int64_t sequence) {
    double period = options_.nominal_period_s;
    double half_range = options_.nominal_period_sigma_s > 0 ? 4 * options_.nominal_period_sigma_s
                                                            : options_.max_skew * period;
    if (!(period > 0)) {
      period = 0.5 * kMaxPeriod;
      half_range = 0.5 * kMaxPeriod;
    }
    return accept(receive_time_s, static_cast<double>(sequence), period, half_range);
  }

  // Host time of any sender time (or count), with the line as it is now. 0 before the first item.
  double to_host(double sender) const {
    return items_ == 0 ? 0.0 : anchor_receive_ + line_.value_at(sender - anchor_sender_);
  }
  double sigma(double sender) const { return sigma_at(sender - anchor_sender_); }

  // Seconds of host clock per second of sender clock, less one; or the period of a counted stream.
  double skew() const { return line_.slope - 1; }
  double period_s() const { return line_.slope; }

  // Sum of the floor shifts since the start: what the least delay is now, less what it was.
  double floor_shift_s() const { return shift_; }

  // For a reconnection that the caller knows of. The next item starts a new line.
  void restart() {
    ++counters_.restarts;
    begin_again();
  }

  const ClockCounters& counters() const { return counters_; }
  ClockState state() const { return state_; }

 private:
  static constexpr double kMaxPeriod = 10;  // s

  void begin_again() {
    items_ = 0;
    state_ = ClockState::kWarmingUp;
  }

  double sigma_at(double x) const {
    return items_ == 0 ? options_.expected_jitter_s : std::sqrt(line_.variance_at(x));
  }

  ClockEstimate accept(double receive, double sender, double rate, double half_range) {
    (void)rate;
    (void)half_range;
    ++counters_.items;
    ++items_;
    anchor_receive_ = receive;
    anchor_sender_ = sender;
    ClockEstimate estimate;
    estimate.time_s = receive;
    estimate.sigma_s = options_.expected_jitter_s;
    return estimate;
  }

  ClockFilterOptions options_;
  ClockCounters counters_;
  ClockState state_ = ClockState::kWarmingUp;
  std::int64_t items_ = 0;
  double anchor_receive_ = 0;
  double anchor_sender_ = 0;
  double shift_ = 0;
  LineEstimate line_;
};

static_assert(std::is_trivially_copyable_v<ClockFilter<>>,
              "copied through queues, never allocates");

}  // namespace alidade
