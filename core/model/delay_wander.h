#pragma once
// DelayWander: detects whether a stream's items leave the line of its clock repeatedly, and how
// far.
//   lateness_i = receive_i - line(sender_i); its minimum over a window is about 0 on the line
// Usually the minimum delay is constant, or it steps (MinimumDelayStep). If it rises and falls
// again and again, there are two causes. The delay wanders, as behind a relay whose buffer fills
// and empties; or the stamps wander, and arrivals tell the time better than the line. Stamps alone
// cannot tell which. So the distance from the line is an uncertainty of an item's time
// (docs/clocks.md). Fixed memory, trivially copyable, no allocation, no exceptions; one thread.
// Host clock, seconds.

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <type_traits>

namespace alidade {

class DelayWander {
 public:
  // Two windows: parts of kPart_s follow quickly, parts of kLongPart_s see what jitter hides from
  // those.
  static constexpr double kPart_s = 0.25;
  static constexpr double kLongPart_s = 1;
  static constexpr double kWander_s = 1e-3;  // smaller distances do not count
  static constexpr double kMemory_s = 20;    // time constant

  // For a new line. The present uncertainty stays and fades.
  void restart() { windows_ = {{{kPart_s, {}, {}}, {kLongPart_s, {}, {}}}}; }

  // Values must be finite. receive_s: in order. gate_s: the line's own uncertainty, >= 0.
  void add(double receive_s, double lateness_s, double gate_s) {
    const double since_s = std::max(0.0, receive_s - last_s_);
    last_s_ = receive_s;
    now_s_ = 0;
    for (Window& window : windows_) {
      window.add(receive_s, lateness_s);
      now_s_ = std::max(now_s_, window.off_s(gate_s));
    }
    seen_s_ = std::max(now_s_, seen_s_ * std::exp(-since_s / kMemory_s));
    // A silence counts as one part at most.
    const double off = now_s_ > kWander_s ? 1 : 0;
    share_ += (off - share_) * std::min(since_s, kPart_s) / kMemory_s;
  }

  // True if the stream was off the line by more than kWander_s for more than the share kShare of
  // the time, as averaged exponentially with kMemory_s.
  [[nodiscard]] bool wanders() const { return share_ > kShare; }
  // s; how far an item may be off the line, as of the last item. While the stream wanders, the
  // value fades with the time constant kMemory_s.
  [[nodiscard]] double off_s() const { return wanders() ? seen_s_ : now_s_; }

 private:
  static constexpr double kLeastItems = 3;
  static constexpr double kOdds = 10;
  static constexpr double kShare = 0.15;

  struct Part {
    double since_s = 0;
    double items = 0;
    double least_s = std::numeric_limits<double>::infinity();
    double second_s = std::numeric_limits<double>::infinity();  // the second lowest
    double sum_s = 0;

    void add(double receive_s, double lateness_s) {
      if (items == 0) since_s = receive_s;
      items += 1;
      sum_s += lateness_s;
      second_s = std::min(second_s, std::max(least_s, lateness_s));
      least_s = std::min(least_s, lateness_s);
    }
  };

  struct Window {
    double part_s = 0;
    Part old = {};
    Part young = {};

    void add(double receive_s, double lateness_s) {
      if (young.items >= kLeastItems && receive_s - young.since_s >= part_s) {
        old = young;
        young = {};
      }
      young.add(receive_s, lateness_s);
    }

    // Distance from the line; 0: on the line. Off the line means one of two things:
    // - The minimum lateness of both parts is beyond the gate and beyond chance. If n exponential
    // delays have the minimum m and the mean m + s, m > c s has odds of (1 + c)^-(n - 1). kOdds
    // sets them to e^-10.
    // - Two items come before the line by more than the gate, as nothing is early.
    // The distance is the larger minimum of the parts, plus their difference: the latest item is
    // farther off than both minima.
    [[nodiscard]] double off_s(double gate_s) const {
      if (old.items == 0) return 0;
      const double items = old.items + young.items;
      const double least_s = std::min(old.least_s, young.least_s);
      const double above_s = (old.sum_s + young.sum_s) / items - least_s;
      const double late_s = std::max(gate_s, above_s * std::expm1(kOdds / (items - 1)));
      const double second_s =
          std::min(std::max(old.least_s, young.least_s), std::min(old.second_s, young.second_s));
      if (least_s <= late_s && second_s >= -gate_s) return 0;
      // A part that has just begun has too few items for its minimum.
      const double now_s = young.items >= kLeastItems ? young.least_s : old.least_s;
      return std::max(std::abs(old.least_s), std::abs(now_s)) + std::abs(now_s - old.least_s);
    }
  };

  std::array<Window, 2> windows_{{{kPart_s, {}, {}}, {kLongPart_s, {}, {}}}};
  double last_s_ = 0;
  double now_s_ = 0;
  double seen_s_ = 0;
  double share_ = 0;
};

static_assert(std::is_trivially_copyable_v<DelayWander>);

}  // namespace alidade
