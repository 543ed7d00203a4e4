#pragma once
// MinimumDelayStep: detects a step of a stream's minimum delay, its time and its size, from
// residuals (receive time minus line). Two runs of items are kept: late ones, and all from the
// first early one on.
//   rise  no item comes down to the line for settle_s
//   fall  two or more items come before the line
// A rise or a fall is a step only if the minimum residuals of two neighbouring halves of settle_s
// agree.
// Fixed memory, trivially copyable, no allocation, no exceptions. All times are host seconds.
// Statistics: docs/clocks.md.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>

#include "core/model/clock_types.h"

namespace alidade::internal {

struct DelayStep {
  double since_s = 0;  // receive time; items from here on are known to have the new minimum
  double step_s = 0;   // new minimum delay minus the old one
  double sigma_s = 0;  // of step_s
};

class MinimumDelayStep {
 public:
  explicit MinimumDelayStep(const ClockFilterOptions& options)
      : settle_s_(options.settle_s), resolution_s_(options.stamp_resolution_s) {}

  void restart() {
    late_ = early_ = {};
    stretch_ = {};
  }

  // An item came down to the line, so there is no rise.
  void end_late_run() {
    late_ = {};
    stretch_ = {};
  }

  // The step, if a run has lasted until this receive time and shows one. Both runs then begin anew.
  // To be called before the item is added to a run. rate_sigma: of the line's rate (host seconds
  // per host second); the halves may differ by it.
  std::optional<DelayStep> judge(double receive_s, double rate_sigma = 0) {
    const double drift_s = kReach * rate_sigma * settle_s_ / 2;
    const std::optional<DelayStep> fall = judge(&early_, true, receive_s, drift_s);
    return fall ? fall : judge(&late_, false, receive_s, drift_s);
  }

  void add_late(double receive_s, double residual_s) { late_.add(receive_s, residual_s, false); }
  // The same item, after add_late(). mean_s: usual mean delay above the line, s.
  void suspect(double receive_s, double residual_s, double mean_s) {
    stretch_.add(receive_s, residual_s, std::max(mean_s, resolution_s_));
  }
  // For all items from the first early one on, early or not.
  void add_after_early(double receive_s, double residual_s, bool is_early) {
    early_.add(receive_s, residual_s, is_early);
  }

  [[nodiscard]] bool suspects_fall() const { return early_.active; }
  [[nodiscard]] bool suspects_any() const { return late_.active || early_.active; }
  [[nodiscard]] bool suspects_rise() const {
    return stretch_.items >= kLeastItems && stretch_.score >= kSameMinimum &&
           stretch_.last - stretch_.first >= settle_s_ / 20;
  }
  // Receive time of the suspected rise's first item.
  [[nodiscard]] double suspected_since_s() const { return stretch_.first; }

 private:
  static constexpr double kSameMinimum = 20;  // e^-20: odds that the difference is chance
  static constexpr double kLeastItems = 3;    // in half a run
  static constexpr double kReach = 6;         // sigmas
  static constexpr std::size_t kLowest = 8;   // residuals that a half's spread is taken from

  // A suspected rise, long before it is judged. n exponential delays of mean s all exceed m with
  // probability e^(-n m / s). Among the runs of late items that end with the last one, it keeps the
  // run with the greatest n m / s.
  struct Stretch {
    double items = 0;
    double first = 0;  // receive times
    double last = 0;
    double least = std::numeric_limits<double>::infinity();
    double score = 0;  // -log of the probability

    void add(double receive, double residual, double mean) {
      const double longer = (items + 1) * std::min(least, residual) / mean;
      const double alone = residual / mean;
      if (items == 0 || longer < alone) {
        items = 0;
        least = residual;
        first = receive;
      }
      items += 1;
      least = std::min(least, residual);
      last = receive;
      score = std::max(longer, alone);
    }
  };

  struct Run {
    bool active = false;
    double first = 0;   // receive time of the first item
    double since = 0;   // of the older half's first item
    double middle = 0;  // of the younger half's first item
    double older = 0;   // minimum residual
    // The younger half:
    double items = 0;
    double early = 0;
    double sum = 0;
    std::array<double, kLowest> lowest = {};  // residuals, ascending

    void add(double receive, double residual, bool is_early) {
      if (!active) {
        active = true;
        first = since = middle = receive;
        older = residual;
      }
      const std::size_t n = held();
      if (n < kLowest || residual < lowest[n - 1]) {
        const auto last = lowest.begin() + std::min(n, kLowest - 1);
        *last = residual;
        std::rotate(std::upper_bound(lowest.begin(), last, residual), last, last + 1);
      }
      items += 1;
      early += is_early ? 1 : 0;
      sum += residual;
    }
    void begin_half(double receive) {
      since = middle;
      older = younger();
      middle = receive;
      items = early = sum = 0;
    }
    // Its minimum residual.
    [[nodiscard]] double younger() const {
      return items > 0 ? lowest[0] : std::numeric_limits<double>::infinity();
    }
    [[nodiscard]] std::size_t held() const {
      return items < static_cast<double>(kLowest) ? static_cast<std::size_t>(items) : kLowest;
    }
    // Standard deviation of a half's minimum residual if its delays are exponential.
    [[nodiscard]] double spread() const { return (sum / items - younger()) / items; }
    // The same whatever the delays are, such as a relay's, few of which are short: the mean spacing
    // of the lowest residuals. Strays among them make it large.
    [[nodiscard]] double spacing() const {
      const std::size_t n = held();
      return n < 2 ? 0 : (lowest[n - 1] - lowest[0]) / static_cast<double>(n - 1);
    }
  };

  std::optional<DelayStep> judge(Run* run, bool falls, double receive, double drift) {
    if (!run->active || receive - run->middle < settle_s_ / 2) {
      return std::nullopt;
    }
    if (falls && run->early < 2) {
      *run = {};  // a stray outlier
      return std::nullopt;
    }
    const double spread = std::max({run->spread(), falls ? 0 : run->spacing(), resolution_s_});
    const double step = std::min(run->older, run->younger());
    if (run->middle == run->since || run->items < kLeastItems ||
        std::abs(run->older - run->younger()) > kSameMinimum * spread + drift ||
        (!falls && step < kSameMinimum * spread)) {
      run->begin_half(receive);
      return std::nullopt;
    }
    const double since = falls ? run->first : run->since;
    restart();
    return DelayStep{since, step - spread / 2, spread / 2};
  }

  double settle_s_;
  double resolution_s_;
  Stretch stretch_;
  Run late_;
  Run early_;
};

}  // namespace alidade::internal
