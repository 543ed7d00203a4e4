#pragma once
// UnevenArrivals: the capture times of a live stream that is known by its arrivals only, and whose
// camera leaves pictures out. The count of such pictures is no clock, as receipt_clock.h needs it.
// A picture that comes after more than the usual interval has waited for the excess at most, or it
// follows a missing picture. Its time is the middle of the possible ones, and sigma covers them.
// Ages beyond kLongest_s are unknown, and so are ages at a connection's beginning. What the next
// pictures show: docs/derivations.md. Seconds of the host's clock. Fixed memory, no allocation, one
// thread.

#include <algorithm>
#include <cmath>

#include "edge_app/clocks/receipt_clock.h"

namespace alidade {

class UnevenArrivals {
 public:
  static constexpr double kLongest_s = ReceiptClock::kLongest_s;
  static constexpr int kPunctual = 5;

  explicit UnevenArrivals(double stamp_sigma_s) : stamp_sigma_s_(stamp_sigma_s) {}

  // To be called at a (re)connection. The usual interval is kept. interval_s: a first guess of the
  // usual interval; 0: none.
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
    // The median of intervals: those that follow a missing picture do not lengthen it.
    usual_s_ *= interval_s > usual_s_ ? 1 + kLearn : 1 - kLearn;
    // Jitter that the receive time's sigma already covers.
    const double late_s = std::max(0.0, late_s_ - stamp_sigma_s_);
    const bool known = punctual_ == kPunctual && late_s <= kLongest_s;
    return {receive_time_s - late_s / 2, std::hypot(stamp_sigma_s_, late_s / std::sqrt(12.0)),
            known};
  }

 private:
  // A shorter interval, in units of the usual one, means that the picture had waited behind
  // another.
  static constexpr double kShort = 0.6;
  static constexpr double kLearn = 0.005;

  double stamp_sigma_s_;
  double usual_s_ = 0;  // interval
  double last_s_ = 0;
  double late_s_ = 0;  // upper limit, of the last picture
  bool began_ = false;
  int punctual_ = 0;  // in a row, at the connection's beginning
};

}  // namespace alidade
