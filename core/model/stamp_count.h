#pragma once
// StampCount: detects stamps that count items instead of telling time.
//   sender_i = constant + step (i + lost in the network),  whatever time passes between two items
// If such a sender leaves items out or takes them at another rate, its stamps do not show this:
// receive - sender rises and never falls again. A growing backlog makes receive - sender rise, too,
// but not for ever (docs/clocks.md).
// Fixed memory, trivially copyable, no allocation, no exceptions; one thread. All times are
// seconds.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <type_traits>

namespace alidade {

class StampCount {
 public:
  static constexpr std::size_t kParts = 32;     // s
  static constexpr std::size_t kFewParts = 12;  // s
  static constexpr double kSteps = 6;           // least rise, in steps
  static constexpr double kApart_s = 3;         // least rise of any kind
  static constexpr double kNearApart_s = 1;     // the same if it rises slowly
  static constexpr double kNear = 0.06;         // s/s, largest slow rise

  void restart() { *this = StampCount(); }

  // Values must be finite. If the stamp did not grow, or grew by more than kLongestStep_s, all is
  // forgotten.
  void add(double receive_s, double sender_s) {
    const double step_s = sender_s - last_sender_s_;
    const bool first = !any_;
    any_ = true;
    last_sender_s_ = sender_s;
    if (first) {
      last_receive_s_ = receive_s;
      return begin_part(receive_s);
    }
    if (!(step_s > 0) || step_s > kLongestStep_s) return restart();
    if (step_s_ == 0 || step_s < step_s_ - kSame_s) {
      step_s_ = step_s;
      size_ = 0;
      begin_part(receive_s);
    }
    // The finest step defines the grid. Stamps off the grid do not count items.
    const double steps = std::round(step_s / step_s_);
    if (std::abs(step_s - steps * step_s_) > kSame_s) {
      size_ = 0;
      begin_part(receive_s);
      return;
    }
    if (items_ >= kLeastItems && receive_s - since_s_ >= kPart_s) end_part(receive_s);
    const double level_s = receive_s - sender_s;
    longest_gap_s_ = std::max(longest_gap_s_, receive_s - last_receive_s_);
    last_receive_s_ = receive_s;
    ++items_;
    if (level_s >= part_.level_s) return;
    part_ = {receive_s, level_s};
  }

  // The stamps' rate minus 1, if they are shown to count. All stamps must be on one grid. The
  // minima of receive - sender in kFewParts to kParts seconds must not fall (beyond kBack_s) and
  // must rise
  //   by whole steps  to within kOnStep of a step, and by kSteps or more: no backlog grows like
  //                   that;
  //   or in any way   by kApart_s, or by kNearApart_s if no second's rise exceeds kNear.
  [[nodiscard]] std::optional<double> rate_error() const {
    if (size_ < kFewParts) return std::nullopt;
    const Part& first = part(0);
    const Part& last = part(size_ - 1);
    const double apart_s = last.level_s - first.level_s;
    const double span_s = last.receive_s - first.receive_s;
    const double enough_s = rises_slowly() ? kNearApart_s : kApart_s;
    if (apart_s < enough_s && !(apart_s >= kSteps * step_s_ && rises_by_steps()))
      return std::nullopt;
    return -apart_s / span_s;
  }

  // s; the finest step between two stamps. 0: unknown.
  [[nodiscard]] double step_s() const { return step_s_; }

 private:
  static constexpr double kSame_s = 1.5e-4;  // tolerance of the grid
  static constexpr double kLongestStep_s = 1;
  static constexpr double kPart_s = 1;     // one part, of which the minimum counts
  static constexpr double kBack_s = 0.02;  // a larger fall starts anew
  static constexpr double kStall_s = 0.5;
  static constexpr double kOnStep = 0.15;  // of a step
  static constexpr std::size_t kLeastItems = 3;

  struct Part {
    double receive_s = 0;  // of the item with the lowest level
    double level_s = std::numeric_limits<double>::infinity();
  };

  [[nodiscard]] const Part& part(std::size_t i) const { return parts_[(begin_ + i) % kParts]; }

  void begin_part(double receive_s) {
    since_s_ = receive_s;
    items_ = 0;
    longest_gap_s_ = 0;
    part_ = Part();
  }

  // A rise of more than kStall_s, after as long without an item, is a stall: start anew.
  void end_part(double receive_s) {
    if (size_ > 0) {
      const double rise_s = part_.level_s - part(size_ - 1).level_s;
      const double stall_s = std::max(longest_gap_s_, gap_before_s_);
      if (rise_s < -kBack_s || (rise_s > kStall_s && stall_s > kStall_s)) size_ = 0;
    }
    if (size_ == kParts) {
      begin_ = (begin_ + 1) % kParts;
      --size_;
    }
    parts_[(begin_ + size_) % kParts] = part_;
    ++size_;
    gap_before_s_ = longest_gap_s_;
    begin_part(receive_s);
  }

  [[nodiscard]] bool rises_slowly() const {
    for (std::size_t i = 1; i < size_; ++i) {
      if (part(i).level_s - part(i - 1).level_s > kNear * kPart_s) return false;
    }
    return true;
  }

  // Measured from the mean phase, as the first item may itself be late.
  [[nodiscard]] bool rises_by_steps() const {
    double sine = 0;
    double cosine = 0;
    constexpr double kTurn = 6.283185307179586;
    for (std::size_t i = 0; i < size_; ++i) {
      const double turns = (part(i).level_s - part(0).level_s) / step_s_;
      sine += std::sin(kTurn * turns);
      cosine += std::cos(kTurn * turns);
    }
    const double phase = std::atan2(sine, cosine) / kTurn;
    for (std::size_t i = 0; i < size_; ++i) {
      const double turns = (part(i).level_s - part(0).level_s) / step_s_ - phase;
      if (std::abs(turns - std::round(turns)) > kOnStep) return false;
    }
    return true;
  }

  std::array<Part, kParts> parts_{};  // the oldest at begin_
  std::size_t begin_ = 0;
  std::size_t size_ = 0;
  Part part_;  // the current second
  double since_s_ = 0;
  std::size_t items_ = 0;
  double longest_gap_s_ = 0;  // in the current second, without an item
  double gap_before_s_ = 0;   // in the second before
  double last_receive_s_ = 0;
  bool any_ = false;
  double last_sender_s_ = 0;
  double step_s_ = 0;  // of the grid; 0: unknown
};

static_assert(std::is_trivially_copyable_v<StampCount>);

}  // namespace alidade
