#pragma once
// StampJumps: detects stamps that jump although the items come evenly.
//   jump_i = (sender_i - sender_(i-1)) - (receive_i - receive_(i-1))
// A varying delay moves the arrival. An item that is left out moves arrival and stamp, except at
// the end of a backlog. If the arrival came at the usual interval and the stamp did not, the stamp
// jumped, and the line through the stamps errs by the jump at once. Slow wander is DelayWander's
// task.
// Fixed memory, trivially copyable, no allocation, no exceptions; one thread. All times are
// seconds.

#include <algorithm>
#include <cmath>
#include <type_traits>

namespace alidade {

class StampJumps {
 public:
  static constexpr double kLeast_s = 2e-3;
  static constexpr double kGate = 3;
  static constexpr double kMemory_s = 2;

  void restart() { *this = StampJumps(); }

  // Values must be finite. behind_backlog: the item before had waited, so this one shows no jump;
  // nor do the first kFewItems. Overtaken items are ignored.
  // A jump: the stamp's interval differs from the usual interval by more than twice the difference
  // of the arrival's interval, and |jump| exceeds kLeast_s and kGate times the arrivals' mean
  // deviation. A jump fades with kMemory_s: by then the line has taken up a single step, and a
  // clock that jumps has jumped again.
  void add(double receive_s, double sender_s, bool behind_backlog) {
    const double arrival_s = receive_s - last_receive_s_;
    const double stamp_s = sender_s - last_sender_s_;
    if (items_ > 0 && stamp_s < 0) return;
    last_receive_s_ = receive_s;
    last_sender_s_ = sender_s;
    if (++items_ < 2 || !(arrival_s > 0)) return;
    if (items_ == 2) usual_s_ = arrival_s;
    const double arrival_off_s = std::abs(arrival_s - usual_s_);
    const double stamp_off_s = std::abs(stamp_s - usual_s_);
    const double jump_s = std::abs(stamp_s - arrival_s);
    seen_s_ *= std::exp(-arrival_s / kMemory_s);
    if (items_ > kFewItems && !behind_backlog && stamp_off_s > 2 * arrival_off_s &&
        jump_s > std::max(kLeast_s, kGate * spread_s_))
      seen_s_ = std::max(seen_s_, jump_s);
    // Median of the intervals, and mean deviation from it. A very late item counts as one interval
    // late.
    usual_s_ *= arrival_s > usual_s_ ? 1 + kLearn : 1 - kLearn;
    spread_s_ += (std::min(arrival_off_s, usual_s_) - spread_s_) / std::min(items_, kManyItems);
  }

  // s; how wrong stamps may be now.
  [[nodiscard]] double off_s() const { return seen_s_; }

 private:
  static constexpr double kLearn = 0.005;
  static constexpr double kFewItems = 25;  // until the usual interval is known
  static constexpr double kManyItems = 100;

  double items_ = 0;
  double last_receive_s_ = 0;
  double last_sender_s_ = 0;
  double usual_s_ = 0;   // median interval of arrivals
  double spread_s_ = 0;  // mean deviation of arrivals' intervals from it
  double seen_s_ = 0;
};

static_assert(std::is_trivially_copyable_v<StampJumps>);

}  // namespace alidade
