#pragma once
// ArrivalPace: detects whether a stream's items come at their sender's pace or are a backlog.
//   receive_i - sender_i = constant + delay_i + age_i
// After a stall (a relay, a network or a process that stood still) items wait and then come faster
// than they were sent: receive - sender falls until the last waiting item has come. During the fall
// nobody knows where it will end, so an item's age is unknown. A stream that is late by a constant
// cannot be distinguished from a network with that delay.
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

class ArrivalPace {
 public:
  static constexpr double kBacklog_s = 0.1;  // longer waits are not jitter
  static constexpr double kLeastHalf_s = 0.25;

  // The run of items that shows the pace, without the rest of a backlog.
  struct Shown {
    std::size_t first = 0;  // index among the items kept
    double least_s = 0;     // its minimum of receive - sender
  };

  void restart() {
    size_ = begin_ = 0;
    greatest_s_ = -std::numeric_limits<double>::infinity();
  }

  // Values must be finite. An item whose stamp is not later than the last one's is ignored. If it
  // is earlier by kOvertaken_s or more, it is of another clock: the judgement begins anew with it.
  void add(double receive_s, double sender_s) {
    if (size_ > 0 && !(sender_s > item(size_ - 1).sender_s)) {
      if (sender_s > item(size_ - 1).sender_s - kOvertaken_s) return;
      restart();
    }
    if (size_ == kItems) {
      begin_ = (begin_ + 1) % kItems;
      --size_;
    }
    items_[(begin_ + size_) % kItems] = {receive_s, sender_s};
    ++size_;
    greatest_s_ = std::max(greatest_s_, receive_s - sender_s);
  }

  // Judges the items up to the last one. Empty: the pace is not shown, or no longer. The pace is
  // shown if the minima of receive - sender in two neighbouring halves of a window agree to the
  // tolerance, each confirmed by a second item. (Delays only add, so minima count. A rise is a new
  // stall, so it counts like a fall.) A half lasts kLeastHalf_s or one of its doubles, so that one
  // of these lengths fits slow streams and delays with a rhythm (key frames).
  // least_half_s: the shortest half used. After a backlog the shortest window is not used, as the
  // rest of a backlog may come more slowly. no_backlog: something else shows that the last item did
  // not wait; the shortest window is then used.
  [[nodiscard]] std::optional<Shown> shown(double least_half_s = kLeastHalf_s,
                                           bool no_backlog = false) const {
    if (size_ < 2 * kLeastItems) return std::nullopt;
    const double now_s = item(size_ - 1).receive_s;
    double half_s = kLeastHalf_s;
    for (int i = 0; i < kWindows && item(0).receive_s <= now_s - 2 * half_s; ++i, half_s *= 2) {
      if (half_s < least_half_s) continue;
      const Half young = half(size_, now_s - half_s);
      const Half old = half(young.first, now_s - 2 * half_s);
      if (!young.stands() || !old.stands()) continue;
      const double tolerance_s = std::max(kSame_s, 3 * std::max(young.spread_s, old.spread_s));
      const double least_s = std::min(young.least_s, old.least_s);
      if (std::abs(young.least_s - old.least_s) > tolerance_s) continue;
      if (i == 0 && !no_backlog && saw_backlog(least_s)) continue;
      std::size_t first = old.first;
      while (level(first) > least_s + kBacklog_s) ++first;
      return Shown{first, least_s};
    }
    return std::nullopt;
  }

  // True if an item since the restart waited longer by longer_s than items at the level least_s.
  [[nodiscard]] bool saw_backlog(double least_s, double longer_s = kBacklog_s) const {
    return greatest_s_ > least_s + longer_s;
  }

  // The latest items, 128 at most, oldest first; s. i: below size().
  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] double receive_s(std::size_t i) const { return item(i).receive_s; }
  [[nodiscard]] double sender_s(std::size_t i) const { return item(i).sender_s; }

 private:
  static constexpr std::size_t kItems = 128;
  static constexpr std::size_t kLeastItems = 2;  // in a half
  static constexpr int kWindows = 6;             // up to 8 s
  // Tolerance: kSame_s, or 3 standard deviations of a half's minimum of n exponential delays: their
  // mean above the minimum, divided by n. Waits of more than kBacklog_s are not delays.
  // A steady fall by D between the halves has a mean of D / 2 above the minimum, so the tolerance
  // is 3 D / (2 n): such a fall does not count as a pace for any D beyond kSame_s. At the shortest
  // window this is a backlog that is worked off 0.8 % faster than it grows.
  static constexpr double kSame_s = 2e-3;
  static constexpr double kNear_s = 5e-3;
  static constexpr double kOvertaken_s = 1;

  struct Item {
    double receive_s;
    double sender_s;
  };
  struct Half {
    std::size_t first = 0;
    std::size_t items = 0;
    double least_s = std::numeric_limits<double>::infinity();
    double second_s = std::numeric_limits<double>::infinity();  // the second lowest
    double spread_s = 0;  // standard deviation of the minimum if the delays are exponential
    // True if the minimum is not a moment in a fall.
    [[nodiscard]] bool stands() const {
      return items >= kLeastItems && second_s - least_s <= std::max(kNear_s, spread_s);
    }
  };

  [[nodiscard]] const Item& item(std::size_t i) const { return items_[(begin_ + i) % kItems]; }

  [[nodiscard]] double level(std::size_t i) const { return item(i).receive_s - item(i).sender_s; }

  // The items before `end` that were received at since_s or later.
  [[nodiscard]] Half half(std::size_t end, double since_s) const {
    Half half;
    half.first = end;
    while (half.first > 0 && item(half.first - 1).receive_s >= since_s) {
      --half.first;
      ++half.items;
      const double level_s = level(half.first);
      half.second_s = std::min(half.second_s, std::max(half.least_s, level_s));
      half.least_s = std::min(half.least_s, level_s);
    }
    double sum_s = 0;
    double n = 0;
    for (std::size_t i = half.first; i < end; ++i) {
      const double above_s = level(i) - half.least_s;
      if (above_s > kBacklog_s) continue;  // not a delay: one such would look like a wide spread
      sum_s += above_s;
      ++n;
    }
    if (n > 0) half.spread_s = sum_s / (n * n);
    return half;
  }

  std::array<Item, kItems> items_{};
  std::size_t begin_ = 0;
  std::size_t size_ = 0;
  double greatest_s_ = -std::numeric_limits<double>::infinity();  // receive - sender
};

static_assert(std::is_trivially_copyable_v<ArrivalPace>);

}  // namespace alidade
