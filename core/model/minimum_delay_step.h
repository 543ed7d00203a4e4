#pragma once
// MinimumDelayStep: does the least delay of a stream step, and when and by how much did it?
//
// A rise: for settle_s no item comes down to the line. A fall: some come before it. Both are a step only if the least
// residuals of two neighbouring halves of settle_s agree: otherwise the new minimum is none. Fed with residuals
// (receive time less line); keeps two runs of items, those that stay late and those from the first early one on.
// A rise is suspected long before it is judged: the chance that n exponential delays of mean s all stay beyond m is
// e^(-n m / s); of the stretches of late items up to the last one that with the greatest n m / s is kept.
// Fixed memory, trivially copyable, no allocation, no exceptions. All times are host seconds.

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "core/model/clock_types.h"

namespace alidade::internal {

struct DelayStep {
  double since_s = 0;  // receive time of the first item with the new minimum
  double step_s = 0;   // new minimum delay less the old one
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

  // An item came down to the line: no rise.
  void end_late_run() {
    late_ = {};
    stretch_ = {};
  }

  // Has a run lasted until this receive time and shown a step? Both runs begin anew then. To be asked before the
  // item is added to a run. rate_sigma: of the line's rate, host seconds per host second, by which the halves may differ.
  std::optional<DelayStep> judge(double receive_s, double rate_sigma = 0) {
    const double drift_s = kReach * rate_sigma * settle_s_ / 2;
    const std::optional<DelayStep> fall = judge(&early_, true, receive_s, drift_s);
    return fall ? fall : judge(&late_, false, receive_s, drift_s);
  }

  void add_late(double receive_s, double residual_s) { late_.add(receive_s, residual_s, false); }
  // The same item, where the mean delay above the line has been mean_s.
  void suspect(double receive_s, double residual_s, double mean_s) {
    stretch_.add(receive_s, residual_s, std::max(mean_s, resolution_s_));
  }
  // All items from the first early one on, early or not.
  void add_after_early(double receive_s, double residual_s, bool is_early) {
    early_.add(receive_s, residual_s, is_early);
  }

  [[nodiscard]] bool suspects_fall() const { return early_.active; }
  [[nodiscard]] bool suspects_any() const { return late_.active || early_.active; }
  [[nodiscard]] bool suspects_rise() const {
    return stretch_.items >= kLeastItems && stretch_.score >= kSameMinimum &&
           stretch_.last - stretch_.first >= settle_s_ / 20;
  }
  // Receive time of its first item.
  [[nodiscard]] double suspected_since_s() const { return stretch_.first; }

 private:
  static constexpr double kSameMinimum = 20;  // e^-20: odds that chance explains the difference
  static constexpr double kLeastItems = 3;    // in half a run
  static constexpr double kReach = 6;         // sigmas

  struct Stretch {
    double items = 0;
    double first = 0;  // receive times
    double last = 0;
    double least = std::numeric_limits<double>::infinity();
    double score = 0;  // -log of the chance

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
    double since = 0;   // ... of the older half
    double middle = 0;  // ... of the younger half
    double older = 0;   // least residual
    double younger = 0;
    // Of the younger half:
    double items = 0;
    double early = 0;
    double sum = 0;

    void add(double receive, double residual, bool is_early) {
      if (!active) {
        active = true;
        first = since = middle = receive;
        older = younger = residual;
      }
      younger = std::min(younger, residual);
      items += 1;
      early += is_early ? 1 : 0;
      sum += residual;
    }
    void begin_half(double receive) {
      since = middle;
      older = younger;
      middle = receive;
      younger = std::numeric_limits<double>::infinity();
      items = early = sum = 0;
    }
    // Standard deviation of the least residual of a half, were its delays exponential.
    [[nodiscard]] double spread() const { return (sum / items - younger) / items; }
  };

  std::optional<DelayStep> judge(Run* run, bool falls, double receive, double drift) {
    if (!run->active || receive - run->middle < settle_s_ / 2) {
      return std::nullopt;
    }
    if (falls && run->early < 2) {
      *run = {};  // a stray outlier
      return std::nullopt;
    }
    const double spread = std::max(run->spread(), resolution_s_);
    const double step = std::min(run->older, run->younger);
    if (run->middle == run->since || run->items < kLeastItems ||
        std::abs(run->older - run->younger) > kSameMinimum * spread + drift ||
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
