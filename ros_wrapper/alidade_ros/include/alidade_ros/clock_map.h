#pragma once
// ClockMap: CLOCK_MONOTONIC of the edge host to its wall clock, from pairs of readings.
//
// A pair says: when the monotonic clock showed m, the wall clock showed w, within bracket/2 (the
// wall clock was read between two readings of the other). Linux disciplines both clocks alike, so
// w - m is constant except for steps (settimeofday, a leap second, the first fix by NTP). The
// difference is known as an interval, [w - m] +- bracket/2. Pairs narrow it; a pair that excludes
// it shows a step and starts a new stretch. A time is mapped by the stretch that contains it, so a
// frame captured before a step keeps its stamp. Times between a step and the next pair are mapped
// by the old stretch. Fixed memory: the last kStretches. Not thread-safe.

#include <cstddef>
#include <deque>
#include <optional>

namespace alidade_ros {

struct ClockPair {
  double monotonic_s = 0;
  double wall_s = 0;     // Unix time
  double bracket_s = 0;  // between the two monotonic readings around the wall clock's
};

class ClockMap {
 public:
  static constexpr std::size_t kStretches = 16;

  // stamp_offset_s is added to every wall time.
  explicit ClockMap(double stamp_offset_s = 0) : stamp_offset_s_(stamp_offset_s) {}

  // Pairs must come in order of their monotonic times.
  void add(const ClockPair& pair);

  // Forgets everything: for another host, or after a reboot.
  void reset() { stretches_.clear(); }

  // nullopt before the first pair.
  [[nodiscard]] std::optional<double> wall_from_monotonic(double monotonic_s) const;
  // If a step back makes a wall time occur twice, this is the later one.
  [[nodiscard]] std::optional<double> monotonic_from_wall(double stamp_s) const;

  // Half the width of the newest interval.
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
