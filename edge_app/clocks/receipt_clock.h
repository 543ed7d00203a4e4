#pragma once
// ReceiptClock: the capture times of a stream that tells nothing of its own: its items are stamped when they are
// received, and that is how young they can be at most.
//
// Pictures come one a period, so the count of those that came, times the period, is a clock that can only be slow (by
// what was lost). Held against it the arrivals show their pace (ArrivalPace), and each how late it is: what waited for L
// more than those before may be old by up to L, or be fresh behind a loss. An item is
//   known           while L is at most kLongest_s: its time is the middle of what is possible, and sigma covers it;
//   of unknown age  beyond, until the count comes up with the arrivals (all that waited has come, none was lost), or
//                   the arrivals show the pace (the rest was lost).
// The first period is the slope, by least squares, of kFirst_s of even arrivals, not faster than kFastest_s; by n items with
// delays of standard deviation s it is known to sqrt(12) s / n^(3/2). Later ones are of the least delays at the ends of
// a longer stretch. A period gives way, also after a reconnection, to a slower one after kFirst_s, to a faster one after
// kAnew_s of even arrivals: until then those look like a backlog, and a backlog that comes evenly for longer looks like
// a faster camera.
// Fixed memory, no allocation, one thread. Seconds of the host's clock.

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/model/arrival_pace.h"

namespace alidade {

class ReceiptClock {
 public:
  static constexpr double kLongest_s = 0.05;  // within which a head hardly changes its rate

  struct Answer {
    double time_s = 0;
    double sigma_s = 0;
    bool known = false;
  };

  // stamp_sigma_s: of the receive time of a punctual item, s.
  explicit ReceiptClock(double stamp_sigma_s) : stamp_sigma_s_(stamp_sigma_s) {}

  // Of the connection. The period of the one before is remembered.
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
  static constexpr double kFastest_s = 1.0 / 70;  // period
  static constexpr double kSlower = 1.02;
  static constexpr double kLeastIntervals = 4;
  static constexpr double kEnoughItems = 100;  // for a period
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
      // Faster than the pace: what came before had waited, or the camera is another.
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

  // When the item last added would have come at the latest, were it fresh and none lost.
  [[nodiscard]] double expected_s() const { return fresh_s_ + period_s_ * (count_ - fresh_count_); }

  // The arrivals from the given one on, with a clock of this period.
  [[nodiscard]] ArrivalPace paced(std::size_t from, double period_s) const {
    ArrivalPace pace;
    for (std::size_t i = from; i < arrivals_.size(); ++i) {
      pace.add(arrivals_.receive_s(i), arrivals_.sender_s(i) * period_s);
    }
    return pace;
  }

  // A period from the last arrivals alone, if they are even. A backlog is never slower than the pace.
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

  // By the least delays at both ends: what comes late between them does no harm.
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

  // Of the arrivals over their count, by least squares.
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
  ArrivalPace arrivals_;  // over their count
  double count_ = 0;
  bool began_ = false;
  bool paced_ = false;  // fresh_s_ is known
  bool known_ = false;  // the last item was
  double unknown_since_s_ = 0;
  double period_s_ = 0;  // 0: not known
  double period_sigma_s_ = 0;
  double period_items_ = 0;   // that it is from
  double fresh_s_ = 0;        // arrival of a fresh item with the least delay
  double fresh_count_ = 0;    // its count
  double first_fresh_s_ = 0;  // the same at the beginning of the stretch that the period is from
  double first_fresh_count_ = 0;
};

}  // namespace alidade
