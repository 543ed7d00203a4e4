#pragma once
// ClockMap: CLOCK_MONOTONIC of the edge host to its wall clock, from pairs of readings.
//
// A pair says: when the monotonic clock showed m, the wall clock showed w, to within bracket/2 (the
// wall clock was read between two readings of the other). Linux disciplines both clocks alike, so
// w - m is constant but for steps (settimeofday, a leap second, the first fix of NTP). So the
// difference is an interval, [w - m] +- bracket/2: pairs narrow it down, and one that excludes it is a
// step. Each step begins a new stretch; a time is mapped by the stretch in which it lies, so that a
// frame captured before the step keeps the stamp of its time. Between a step and the next pair times
// are mapped by the old stretch.
// Fixed memory: the last kStretches. Not thread-safe.

#include <cstddef>
#include <deque>
#include <optional>

namespace alidade_ros {

struct ClockPair {
  double monotonic_s = 0;
  double wall_s = 0;     // Unix time
  double bracket_s = 0;  // between the two readings around the wall clock's
};

class ClockMap {
 public:
  static constexpr std::size_t kStretches = 16;

  // stamp_offset_s: added to every wall time.
  explicit ClockMap(double stamp_offset_s = 0) : stamp_offset_s_(stamp_offset_s) {}

  // Pairs come in the order of their monotonic times.
  void add(const ClockPair& pair);

  // Forgets everything: another host, or the same after a reboot.
  void reset() { stretches_.clear(); }

  // None before the first pair.
  [[nodiscard]] std::optional<double> wall_from_monotonic(double monotonic_s) const;
  // Where a step back makes a wall time occur twice, the later one.
  [[nodiscard]] std::optional<double> monotonic_from_wall(double stamp_s) const;

  // Half the width of the newest interval, s.
  [[nodiscard]] std::optional<double> uncertainty_s() const;
  [[nodiscard]] std::size_t steps() const { return steps_; }

 private:
  struct Stretch {
    double begin_monotonic_s;  // of its first pair
    double least_offset_s;     // wall - monotonic
    double greatest_offset_s;
    [[nodiscard]] double offset_s() const { return (least_offset_s + greatest_offset_s) / 2; }
  };
  double stamp_offset_s_;
  std::deque<Stretch> stretches_;  // oldest first
  std::size_t steps_ = 0;
};

}  // namespace alidade_ros
