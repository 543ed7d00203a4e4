#pragma once
// ClockFilter: turns jittery receive times into the times at which a steady clock ticked.
//   receive_i = offset + rate * sender_i + delay_i        (host CLOCK_MONOTONIC, s)
// sender_i is the sender's clock (s; RTP or device time; rate = 1 + skew) or a count (V4L2
// sequence; rate = period). Answers line(sender_i) with its standard deviation. Beyond PTCEE 20,
// 21.
// The constant minimum delay is not observable: it stays in the line and becomes part of the
// calibrated clock offset. So the line must not step. kOneSided (items are never early):
// one_sided_clock.h. kSymmetric (zero-mean noise): symmetric_clock.h. Bad input: see accept().
// Fixed memory, trivially copyable, no allocation, no exceptions; one thread.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "core/model/clock_types.h"
#include "core/model/one_sided_clock.h"
#include "core/model/symmetric_clock.h"

namespace alidade {

template <std::size_t Capacity = 256>
class ClockFilter {
 public:
  // options: validate() must accept them. A filter takes update() or update_sequence(), not both.
  explicit ClockFilter(const ClockFilterOptions& options = {})
      : options_(options), one_sided_(options), symmetric_(options) {}

  // The next item of a stream with a sender clock.
  ClockEstimate update(double receive_time_s, double sender_time_s) {
    return accept(receive_time_s, sender_time_s, sender_rate_prior(options_));
  }

  // The next item of a counted stream; |sequence| < 2^53.
  ClockEstimate update_sequence(double receive_time_s, std::int64_t sequence) {
    return accept(receive_time_s, static_cast<double>(sequence), sequence_rate_prior(options_));
  }

  // Host time (s) of any sender time (s) or count, by the present line. 0 while there is no line:
  // before the first finite item, and from restart() until the next one.
  double to_host(double sender) const {
    return started_ ? anchor_receive_ + line().value_at(sender - anchor_sender_) : 0.0;
  }
  // s; standard deviation of to_host(). expected_jitter_s while there is no line.
  double sigma(double sender) const {
    if (!started_) return options_.expected_jitter_s;
    const double x = sender - anchor_sender_;
    return is_one_sided() ? sigma_at(one_sided_, x) : sigma_at(symmetric_, x);
  }

  // Slope of the line. skew: host seconds per sender second, minus 1. period_s: host seconds per
  // count of a counted stream. Both mean nothing while there is no line.
  double skew() const { return line().slope - 1; }
  double period_s() const { return line().slope; }

  // s; sum of the minimum delay's steps since the line began: the present minimum minus the first.
  // kSymmetric: this and the next two are 0.
  double delay_shift_s() const { return is_one_sided() ? one_sided_.shift_s() : 0.0; }
  // Receive time from which items have the minimum delay of the last step that delay_stepped
  // flagged. A restart does not reset it.
  double delay_shift_since_s() const { return is_one_sided() ? one_sided_.shift_since_s() : 0.0; }
  // s; standard deviation of delay_shift_s(). Every sigma contains it.
  double delay_shift_sigma_s() const {
    return is_one_sided() ? std::sqrt(one_sided_.shift_variance()) : 0.0;
  }

  // s; mean delay above the minimum (one-sided), or sigma of the noise (symmetric).
  double jitter_s() const { return is_one_sided() ? one_sided_.jitter_s() : symmetric_.jitter_s(); }

  // For a reconnection that the caller knows of: the next item starts a new line.
  void restart() {
    ++counters_.restarts;
    announce_restart_ = true;
    started_ = false;
    state_ = ClockState::kWarmingUp;
    one_sided_.restart();
    symmetric_.restart();
  }

  const ClockCounters& counters() const { return counters_; }
  ClockState state() const { return state_; }

 private:
  static constexpr double kMaxSpan_s = 1e12;  // differences of stamps beyond it mean nothing
  static constexpr int kWildToRestart = 3;    // in a row
  static constexpr double kGate = 6;          // sigmas

  bool is_one_sided() const { return options_.jitter == ClockJitter::kOneSided; }
  const LineEstimate& line() const {
    return is_one_sided() ? one_sided_.line() : symmetric_.line();
  }

  // Bad input, in the order of the checks:
  //   not finite  Rejected. The answer is the receive time, or the last answer if that is not
  //               finite.
  //   wild        See is_wild(). Rejected; the answer comes from the receive time. The third in a
  //               row starts a new line (restarted).
  //   step of the minimum delay, one-sided only
  //               See one_sided_clock.h. Flagged once; the line does not step.
  // Lost items are gaps in sender. Repeated and reordered items are answered, but do not move the
  // line. For kOneSided they still count for jitter and steps.
  ClockEstimate accept(double receive, double sender, const ClockRatePrior& prior) {
    return is_one_sided() ? accept(&one_sided_, receive, sender, prior)
                          : accept(&symmetric_, receive, sender, prior);
  }

  template <class Clock>
  ClockEstimate accept(Clock* clock, double receive, double sender, const ClockRatePrior& prior) {
    ++counters_.items;
    if (!std::isfinite(receive) || !std::isfinite(sender)) {
      return reject(*clock, std::isfinite(receive) ? receive : last_time_);
    }
    internal::ClockItem item{};
    if (started_) {
      item = place(*clock, receive, sender);
      if (is_wild(*clock, item)) {
        if (++wild_ < kWildToRestart) {
          return reject(*clock, clock->without_line(receive));
        }
        restart();
      }
    }
    if (!started_) {
      start(clock, receive, sender, prior);
      item = place(*clock, receive, sender);
    }
    wild_ = 0;

    const bool stepped = clock->learn(item);
    counters_.delay_steps += stepped ? 1 : 0;
    last_x_ = std::max(last_x_, item.x);
    if (item.newer && state_ == ClockState::kWarmingUp &&
        receive - first_receive_ >= options_.settle_s &&
        sigma_at(*clock, item.x) < options_.min_delay_step_s) {
      state_ = ClockState::kLocked;
      clock->lock(receive);
    }

    ClockEstimate estimate;
    estimate.time_s = last_time_ = to_host(sender);
    estimate.sigma_s = sigma_at(*clock, item.x);
    estimate.state = state_;
    estimate.restarted = announce_restart_;
    estimate.delay_stepped = stepped;
    announce_restart_ = false;
    return estimate;
  }

  template <class Clock>
  ClockEstimate reject(const Clock& clock, double time_s) {
    ++counters_.rejected;
    ClockEstimate estimate;
    estimate.time_s = last_time_ = time_s;
    estimate.sigma_s = std::max(clock.jitter_s(), options_.expected_jitter_s);
    estimate.state = state_;
    estimate.rejected = true;
    return estimate;
  }

  template <class Clock>
  void start(Clock* clock, double receive, double sender, const ClockRatePrior& prior) {
    started_ = true;
    anchor_receive_ = first_receive_ = receive;
    anchor_sender_ = sender;
    last_x_ = -1;
    clock->start(receive, prior);
  }

  template <class Clock>
  internal::ClockItem place(const Clock& clock, double receive, double sender) const {
    const double x = sender - anchor_sender_;
    return {receive, x, receive - anchor_receive_, sigma_at(clock, x), x > last_x_};
  }

  // True if the sender goes back by more than restart_gap_s, if the receive time is before the line
  // by more than restart_gap_s or after it by more than ten times that (but at least 6 and 60
  // sigma), or if sender or receive time is kMaxSpan_s from the line's first item.
  template <class Clock>
  bool is_wild(const Clock& clock, const internal::ClockItem& item) const {
    if (!(std::abs(item.x) < kMaxSpan_s && std::abs(item.y) < kMaxSpan_s)) {
      return true;
    }
    const double residual = clock.residual(item);
    const double gate = std::max(options_.restart_gap_s, kGate * item.sigma_s);
    return (last_x_ - item.x) * clock.line().slope > options_.restart_gap_s || residual < -gate ||
           residual > 10 * gate;
  }

  // Variance of the line, plus: the wander of the skew since the last item and within the window
  // (docs/clocks.md), the resolution of the stamps, and the steps of the minimum delay.
  template <class Clock>
  double sigma_at(const Clock& clock, double x) const {
    const LineEstimate& line = clock.line();
    const double reach = std::max(0.0, x - last_x_) * line.slope;
    const double memory = clock.memory_s();
    const double wander = options_.skew_wander * options_.skew_wander *
                          (reach * reach * reach / 3 + memory * memory * memory / 270);
    const double resolution = options_.stamp_resolution_s * options_.stamp_resolution_s / 12;
    return std::sqrt(line.variance_at(x) + wander + resolution + clock.shift_variance());
  }

  ClockFilterOptions options_;
  ClockCounters counters_;
  ClockState state_ = ClockState::kWarmingUp;
  bool started_ = false;
  bool announce_restart_ = false;
  int wild_ = 0;
  double last_time_ = 0;

  // The lines count from these, so that a double resolves far below a microsecond.
  double anchor_receive_ = 0;
  double anchor_sender_ = 0;
  double first_receive_ = 0;
  double last_x_ = 0;

  // options_.jitter selects which of the two is used.
  internal::OneSidedClock<Capacity> one_sided_;
  internal::SymmetricClock symmetric_;
};

static_assert(std::is_trivially_copyable_v<ClockFilter<>>,
              "copied through queues, never allocates");

}  // namespace alidade
