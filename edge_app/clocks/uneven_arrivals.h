#pragma once
// UnevenArrivals: the capture times of a live stream of which arrivals alone tell, and whose camera leaves pictures out, now and then or
// often, so that its pictures are no count of time (as receipt_clock.h takes them to be).
//
// A picture that comes after more than the usual interval has waited for the rest of it at most, or came behind one
// that was left out: its time is the middle of what is possible, and sigma covers it. What waits behind it comes at once, each
// less late by what was made up. A picture that comes at the usual interval, or later, follows one that had not waited.
// Of unknown age are those that may be late by more than kLongest_s, and a connection's first ones, until kPunctual in a row
// have come at the usual interval.
// Fixed memory, no allocation, one thread. Seconds of the host's clock.

#include <algorithm>
#include <cmath>

#include "edge_app/clocks/receipt_clock.h"

namespace alidade {

class UnevenArrivals {
 public:
  static constexpr double kLongest_s = ReceiptClock::kLongest_s;
  static constexpr int kPunctual = 5;

  explicit UnevenArrivals(double stamp_sigma_s) : stamp_sigma_s_(stamp_sigma_s) {}

  // Of the connection. The usual interval is remembered. interval_s: a first guess of it, or 0.
  void restart(double interval_s = 0) {
    if (interval_s > 0) usual_s_ = interval_s;
    began_ = false;
    punctual_ = 0;
    late_s_ = 0;
  }

  // receive_time_s: finite.
  ReceiptClock::Answer update(double receive_time_s) {
    const double interval_s = receive_time_s - last_s_;
    last_s_ = receive_time_s;
    if (!began_) {
      began_ = true;
      return {receive_time_s, stamp_sigma_s_, false};
    }
    if (!(usual_s_ > 0)) usual_s_ = interval_s;
    if (interval_s >= kShort * usual_s_) {
      late_s_ = std::max(0.0, interval_s - usual_s_);
      punctual_ = std::min(punctual_ + 1, kPunctual);
    } else {
      late_s_ = std::max(0.0, late_s_ - (usual_s_ - interval_s));
      if (punctual_ < kPunctual) punctual_ = 0;
    }
    // The median: those behind a picture that was left out do not lengthen it.
    usual_s_ *= interval_s > usual_s_ ? 1 + kLearn : 1 - kLearn;
    // A jitter that the receive time's sigma has.
    const double late_s = std::max(0.0, late_s_ - stamp_sigma_s_);
    const bool known = punctual_ == kPunctual && late_s <= kLongest_s;
    return {receive_time_s - late_s / 2, std::hypot(stamp_sigma_s_, late_s / std::sqrt(12.0)),
            known};
  }

 private:
  static constexpr double kShort = 0.6;  // of the usual interval: it had waited behind another
  static constexpr double kLearn = 0.005;

  double stamp_sigma_s_;
  double usual_s_ = 0;  // interval
  double last_s_ = 0;
  double late_s_ = 0;  // at most, the last picture
  bool began_ = false;
  int punctual_ = 0;  // in a row, at a connection's beginning
};

}  // namespace alidade
