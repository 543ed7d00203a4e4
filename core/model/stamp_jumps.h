#pragma once
// StampJumps: do a sender's stamps jump where its items come evenly?
//
//   jump_i = (sender_i - sender_(i-1)) - (receive_i - receive_(i-1))
//
// A delay that varies moves the arrival, an item that is left out both, but for those that a backlog ends with. Where the arrival came at the usual interval and
// the stamp did not, the stamp is what moved, and the line through the stamps is off by so much, at once. Those that wander
// slowly DelayWander sees.
//   jumped  the stamp's interval is off the usual one by more than twice what the arrival's is, and the jump is beyond
//           kLeast_s and kGate times what arrivals are usually off.
// What was seen fades within kMemory_s: a step is the line's own by then, and one that jumps does so again.
// Fixed memory, trivially copyable, no allocation, no exceptions; one thread. All times are seconds.

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

  // Finite values. behind_backlog: the item before had waited. Items that were overtaken teach nothing.
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
    // The median, and how far arrivals are from it in the mean; one that is late by far counts as late.
    usual_s_ *= arrival_s > usual_s_ ? 1 + kLearn : 1 - kLearn;
    spread_s_ += (std::min(arrival_off_s, usual_s_) - spread_s_) / std::min(items_, kManyItems);
  }

  // By how much stamps may be off now.
  [[nodiscard]] double off_s() const { return seen_s_; }

 private:
  static constexpr double kLearn = 0.005;
  static constexpr double kFewItems = 25;  // that tell what is usual
  static constexpr double kManyItems = 100;

  double items_ = 0;
  double last_receive_s_ = 0;
  double last_sender_s_ = 0;
  double usual_s_ = 0;   // interval of arrivals
  double spread_s_ = 0;  // of arrivals about it
  double seen_s_ = 0;
};

static_assert(std::is_trivially_copyable_v<StampJumps>);

}  // namespace alidade
