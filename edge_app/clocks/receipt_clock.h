#pragma once
// ReceiptClock: the capture times of a stream of which only arrivals are known. An arrival is an
// upper limit of the capture time.
//
// One item comes each period, so the count of items times the period is a clock. This clock can
// only be slow, by the lost items. An item that arrives L later than the clock says may be up to L
// old, or fresh behind a loss. If L is at most kLongest_s, the item's time is the middle of the
// possible ones, and sigma covers them. If L is larger, the item's age is unknown until the count
// has caught up with the arrivals, or the arrivals show their pace (ArrivalPace). How the period is
// learnt: docs/derivations.md.
// Seconds of the host's clock. Fixed memory, no allocation, one thread.

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/model/arrival_pace.h"

namespace alidade {

class ReceiptClock {
 public:
  static constexpr double kLongest_s = 0.05;  // a head hardly changes its rate in this time

  struct Answer {
    double time_s = 0;
    double sigma_s = 0;
    bool known = false;  // false: time_s may be late by any amount
  };

  // stamp_sigma_s: of the receive time of a punctual item, s.
  explicit ReceiptClock(double stamp_sigma_s) : stamp_sigma_s_(stamp_sigma_s) {}

  // To be called at a (re)connection. The period of the connection before is kept.
  void restart() {
    began_ = paced_ = known_ = false;
    arrivals_.restart();
  }

  // receive_time_s: finite.
  Answer update(double receive_time_s) {
    if (!began_) {
      began_ = true;
      unknown_since_s_ = receive_time_s;
      count_ = 0;
    }
    arrivals_.add(receive_time_s, ++count_);
    if (!known_) learn_period(receive_time_s);
    const Answer answer = hold_against_pace(receive_time_s);
    if (known_ && !answer.known) unknown_since_s_ = receive_time_s;
    known_ = answer.known;
    return answer;
  }

 private:
  static constexpr double kPunctual_s = 0.01;
  static constexpr double kFirst_s = 1;
  static constexpr double kAnew_s = 30;
  static constexpr double kFastest_s = 1.0 / 70;  // s, period
  static constexpr double kSlower = 1.02;
  static constexpr double kLeastIntervals = 4;
  static constexpr double kEnoughItems = 100;  // to learn a period from
  static constexpr double kManyItems = 1000;

  Answer hold_against_pace(double receive_time_s) {
    const Answer unknown{receive_time_s, stamp_sigma_s_, false};
    if (!(period_s_ > 0)) return unknown;
    const ArrivalPace pace = paced(0, period_s_);
    if (const auto shown = pace.shown()) {
      const double fresh_s = shown->least_s + pace.sender_s(pace.size() - 1);
      if (!paced_ || fresh_s > expected_s() + kPunctual_s) {
        paced_ = true;
        first_fresh_s_ = fresh_s;
        first_fresh_count_ = count_;
      }
      fresh_s_ = fresh_s;
      fresh_count_ = count_;
      refine_period();
    } else if (paced_ && receive_time_s < expected_s() - kPunctual_s) {
      // Faster than the pace: the items before had waited, or the camera is another one.
      paced_ = false;
    }
    if (!paced_) return unknown;
    const double late_s = std::max(0.0, receive_time_s - expected_s() - kPunctual_s);
    if (late_s > kLongest_s) return unknown;
    const double drift_s = period_sigma_s_ * (count_ - fresh_count_);
    return {receive_time_s - late_s / 2,
            std::hypot(stamp_sigma_s_, late_s / std::sqrt(12.0), drift_s), true};
  }

  static double double_of(std::size_t n) { return static_cast<double>(n); }

  // When the item added last would have arrived at the latest, if it were fresh and none had been
  // lost.
  [[nodiscard]] double expected_s() const { return fresh_s_ + period_s_ * (count_ - fresh_count_); }

  // The arrivals from index `from` on, with a clock of this period.
  [[nodiscard]] ArrivalPace paced(std::size_t from, double period_s) const {
    ArrivalPace pace;
    for (std::size_t i = from; i < arrivals_.size(); ++i) {
      pace.add(arrivals_.receive_s(i), arrivals_.sender_s(i) * period_s);
    }
    return pace;
  }

  // Learns a period from the latest arrivals alone, if they are even. A backlog is never slower
  // than the pace.
  void learn_period(double receive_time_s) {
    const bool first = !(period_s_ > 0);
    const double unknown_s = receive_time_s - unknown_since_s_;
    if (unknown_s < kFirst_s) return;
    std::size_t from = arrivals_.size() - 1;
    while (from > 0 && receive_time_s - arrivals_.receive_s(from) < kFirst_s) --from;
    const double intervals = double_of(arrivals_.size() - 1 - from);
    if (intervals < kLeastIntervals) return;
    const double period_s = slope_since(from);
    if (!(period_s > (first ? kFastest_s : 0))) return;
    if (!first && period_s < kSlower * period_s_ && unknown_s < kAnew_s) return;
    if (!paced(from, period_s).shown()) return;
    set_period(period_s, intervals + 1);
    paced_ = false;
  }

  // From the least delays at both ends, so late items in between do no harm.
  void refine_period() {
    const double items = fresh_count_ - first_fresh_count_;
    if (items < std::min(period_items_, kEnoughItems)) return;
    set_period((fresh_s_ - first_fresh_s_) / items, items);
    if (items < kManyItems) return;
    first_fresh_s_ = fresh_s_;
    first_fresh_count_ = fresh_count_;
  }

  void set_period(double period_s, double items) {
    period_s_ = period_s;
    period_items_ = items;
    period_sigma_s_ = std::sqrt(12.0) * stamp_sigma_s_ / (items * std::sqrt(items));
  }

  // Slope of arrival over count since index `from`, by least squares.
  [[nodiscard]] double slope_since(std::size_t from) const {
    const double n = double_of(arrivals_.size() - from);
    const double middle = (n - 1) / 2;
    const double since_s = arrivals_.receive_s(from);
    double sum = 0;
    for (std::size_t i = from; i < arrivals_.size(); ++i) {
      sum += (double_of(i - from) - middle) * (arrivals_.receive_s(i) - since_s);
    }
    return sum * 12 / (n * (n * n - 1));
  }

  double stamp_sigma_s_;
  ArrivalPace arrivals_;  // receive time, count
  double count_ = 0;
  bool began_ = false;
  bool paced_ = false;  // fresh_s_ is known
  bool known_ = false;  // the last item's time was known
  double unknown_since_s_ = 0;
  double period_s_ = 0;  // 0: not known
  double period_sigma_s_ = 0;
  double period_items_ = 0;   // number of items it was learnt from
  double fresh_s_ = 0;        // arrival of a fresh item with the least delay
  double fresh_count_ = 0;    // its count
  double first_fresh_s_ = 0;  // the same at the beginning of the span used for the period
  double first_fresh_count_ = 0;
};

}  // namespace alidade
