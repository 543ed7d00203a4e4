#pragma once
// ReceiptClock: the capture times of a stream that tells nothing of its own: its items are stamped when they are
// received, and that is how young they can be at most.
//
// Pictures come one a period, so the count of those that came, times the period, is a clock that can only be slow (by
// what was lost). Held against it the arrivals show their pace (ArrivalPace) and how late each is: what waited for L
// more than those before may be old by up to L, or be fresh behind a loss. An item is
//   known           while L is at most kLongest_s: its time is the middle of what is possible, and sigma covers it;
//   of unknown age  beyond, until the count comes up with the arrivals (all that waited has come, none was lost), or
//                   the arrivals show the pace (the rest was lost).
// The period is learnt from a stretch of even arrivals, the first time in kFirst_s. A known one, also of the connection
// before, gives way to a slower one after kSlower_s, to a faster one after kAnew_s of even arrivals: a backlog that comes
// evenly for so long looks like a faster camera, and shows when the true pace follows.
// Fixed memory, no allocation, one thread. Seconds of the host's clock.

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/model/arrival_pace.h"

namespace alidade {

class ReceiptClock {
 public:
  static constexpr double kLongest_s = 0.1;

  struct Answer {
    double time_s = 0;
    double sigma_s = 0;
    bool known = false;
  };

  // stamp_sigma_s: of the receive time of a punctual item, s.
  explicit ReceiptClock(double stamp_sigma_s) : stamp_sigma_s_(stamp_sigma_s) {}

  // Of the connection. The period of the one before is remembered.
  void restart() {
    began_ = shown_ = known_ = false;
    pace_.restart();
    even_.restart();
  }

  // receive_time_s: finite.
  Answer update(double receive_time_s) {
    if (!began_) {
      began_ = true;
      unknown_since_s_ = receive_time_s;
      count_s_ = items_ = 0;
    }
    count_s_ += period_s_;
    items_ += 1;
    even_.add(receive_time_s, items_);
    if (period_s_ > 0) pace_.add(receive_time_s, count_s_);
    if (!known_) learn_period(receive_time_s);
    const Answer answer = hold_against_pace(receive_time_s);
    if (known_ && !answer.known) unknown_since_s_ = receive_time_s;
    known_ = answer.known;
    return answer;
  }

 private:
  static constexpr double kPunctual_s = 0.01;
  static constexpr double kFirst_s = 0.5;
  static constexpr double kSlower_s = 1;
  static constexpr double kAnew_s = 3;
  static constexpr double kSlower = 1.02;
  static constexpr double kLeastIntervals = 4;
  static constexpr double kSteadyItems = 50;

  Answer hold_against_pace(double receive_time_s) {
    const Answer unknown{receive_time_s, stamp_sigma_s_, false};
    if (!(period_s_ > 0)) return unknown;
    const double over_s = receive_time_s - count_s_;
    if (const auto shown = pace_.shown()) {
      if (!shown_ || shown->least_s > level_s_ + kPunctual_s) begin_stretch(receive_time_s);
      level_s_ = shown->least_s;
      shown_ = true;
      refine(receive_time_s);
    } else if (shown_ && over_s < level_s_ - kPunctual_s) {
      shown_ = false;  // faster than the pace: what came before had waited, or the camera is another
    }
    const double late_s = std::max(0.0, over_s - level_s_ - kPunctual_s);
    if (!shown_ || late_s > kLongest_s) return unknown;
    return {receive_time_s - late_s / 2, std::hypot(stamp_sigma_s_, late_s / std::sqrt(12.0)), true};
  }

  // A period from the last arrivals alone, if they are even. A backlog is never slower than the pace.
  void learn_period(double receive_time_s) {
    const bool first = !(period_s_ > 0);
    const double unknown_s = receive_time_s - unknown_since_s_;
    const double span_s = first ? kFirst_s : kSlower_s;
    if (unknown_s < span_s) return;
    std::size_t from = even_.size() - 1;
    while (from > 0 && receive_time_s - even_.receive_s(from) < span_s) --from;
    const auto intervals = static_cast<double>(even_.size() - 1 - from);
    if (intervals < kLeastIntervals) return;
    const double period_s = (receive_time_s - even_.receive_s(from)) / intervals;
    if (!first && period_s < kSlower * period_s_ && unknown_s < kAnew_s) return;
    ArrivalPace pace;
    for (std::size_t i = from; i < even_.size(); ++i) {
      pace.add(even_.receive_s(i), static_cast<double>(i - from) * period_s);
    }
    if (!pace.shown()) return;
    period_s_ = period_s;
    pace_ = pace;
    count_s_ = intervals * period_s;
    shown_ = false;
  }

  void begin_stretch(double receive_time_s) {
    stretch_s_ = receive_time_s;
    stretch_items_ = items_;
  }

  // The longer the stretch, the better the period.
  void refine(double receive_time_s) {
    const double items = items_ - stretch_items_;
    if (items < kSteadyItems) return;
    period_s_ = (receive_time_s - stretch_s_) / items;
    if (items >= 20 * kSteadyItems) begin_stretch(receive_time_s);
  }

  double stamp_sigma_s_;
  ArrivalPace pace_;  // by count and period
  ArrivalPace even_;  // by count alone
  bool began_ = false;
  bool shown_ = false;  // level_s_ is known
  bool known_ = false;  // the last item was
  double unknown_since_s_ = 0;
  double period_s_ = 0;  // 0: not known
  double count_s_ = 0;
  double items_ = 0;
  double level_s_ = 0;  // receive - count of a fresh item
  double stretch_s_ = 0;
  double stretch_items_ = 0;
};

}  // namespace alidade
