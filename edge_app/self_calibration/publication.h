#pragma once
// Publication: the calibration that the real-time thread has or gets next, and the state of this
// calibration: whether its clock offset holds, whether it was withdrawn, whether another one is
// wanted. begin_with() comes first. Allocates. One thread.

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "edge_app/record/published_calibration.h"

namespace alidade {

class Publication {
 public:
  using Object = std::shared_ptr<const PublishedCalibration>;

  // The calibration with which the real-time thread begins; not null.
  void begin_with(Object first) {
    present_ = std::move(first);
    clock_holds_ = present_->of_this_connection;
  }
  // `by` takes the place of the present calibration.
  void replace(Object by) {
    present_ = next_ = std::move(by);
    clock_holds_ = present_->of_this_connection;
    is_withdrawn_ = false;
    is_fresh_wanted_ = false;
  }
  // by: the present calibration with other sigmas.
  void widen(Object by) { present_ = next_ = std::move(by); }
  // The present calibration is no longer believed. by: takes its place and is not calibrated. The
  // stored calibration of the present one's zoom is rejected.
  void withdraw(Object by) {
    if (present_->calibration.zoom) rejected_.push_back(*present_->calibration.zoom);
    present_ = next_ = std::move(by);
    is_withdrawn_ = true;
  }
  // The calibration to publish; null: there is nothing new since the last call.
  [[nodiscard]] Object take_next() { return std::exchange(next_, nullptr); }

  [[nodiscard]] const Object& object() const { return present_; }
  [[nodiscard]] const Calibration& calibration() const { return present_->calibration; }
  [[nodiscard]] bool is_withdrawn() const { return is_withdrawn_; }

  // True if the frames' clock has run on since the calibration was made.
  [[nodiscard]] bool clock_holds() const { return clock_holds_; }
  void clock_began_anew() { clock_holds_ = false; }

  // Whether a calibration shall replace the present one as soon as it can be made.
  [[nodiscard]] bool is_fresh_wanted() const { return is_fresh_wanted_; }
  void want_fresh(bool wanted) { is_fresh_wanted_ = wanted; }

  // Whether the stored calibration of this zoom (device units) was withdrawn. tolerance: device
  // units; readings within it are one zoom.
  [[nodiscard]] bool is_rejected(double zoom, double tolerance) const {
    return std::any_of(rejected_.begin(), rejected_.end(), [zoom, tolerance](double rejected) {
      return std::abs(zoom - rejected) <= tolerance;
    });
  }
  // Calibrations of the zooms for which `fits` is true are no longer rejected.
  template <class Fits>
  void accept(const Fits& fits) {
    rejected_.erase(std::remove_if(rejected_.begin(), rejected_.end(), fits), rejected_.end());
  }

 private:
  Object present_;
  Object next_;
  bool clock_holds_ = true;
  bool is_withdrawn_ = false;
  bool is_fresh_wanted_ = false;
  std::vector<double> rejected_;  // zooms whose stored calibrations were withdrawn
};

}  // namespace alidade
