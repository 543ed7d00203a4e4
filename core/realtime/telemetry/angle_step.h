#pragma once
// AngleStep: finds the step of which all readings of a head are multiples, so that nobody has to
// state it. Euclid's algorithm on the differences of successive readings: the differences of a
// continuous angle soon have no common measure left. A head that turns evenly has equal differences
// without any step, so only changes of the difference count. Plain values; no allocation. One
// thread.

#include <algorithm>
#include <cmath>

#include "core/model/angle.h"

namespace alidade {

class AngleStep {
 public:
  // rad, as measured, any turn. An angle that is not finite is ignored.
  void add(double pan, double tilt) {
    pan_.add(pan);
    tilt_.add(tilt);
  }
  // rad, of the coarser axis; 0: none is known.
  [[nodiscard]] double step() const { return std::max(pan_.step(), tilt_.step()); }

 private:
  class Axis {
   public:
    void add(double angle) {
      if (!std::isfinite(angle)) return;
      const double moved = begun_ ? std::abs(wrap_angle(angle - angle_)) : 0;
      const double changed = std::abs(moved - moved_);
      begun_ = true;
      angle_ = angle;
      moved_ = moved;
      if (continuous_ || moved < kSmallest_rad) return;
      if (measure_ == 0) measure_ = moved;
      const double multiple = moved / measure_;
      const double rest = std::abs(multiple - std::round(multiple)) * measure_;
      if (multiple > kMostMultiple) return;  // does not test so small a measure
      if (rest < kExact * measure_) {
        if (changed > 0.5 * measure_) ++agreed_;
        return;
      }
      agreed_ = 0;
      measure_ = rest;
      continuous_ = measure_ < kSmallest_rad;
    }
    [[nodiscard]] double step() const { return !continuous_ && agreed_ >= kEnough ? measure_ : 0; }

   private:
    // Smaller steps come from rounding in a text or in arithmetic, not from the device.
    static constexpr double kSmallest_rad = 2e-7;
    static constexpr double kExact = 0.02;  // of the measure
    static constexpr double kMostMultiple = 1e4;
    static constexpr int kEnough = 6;  // differences; by chance each agrees once in 25

    bool begun_ = false;
    bool continuous_ = false;
    double angle_ = 0;
    double moved_ = 0;  // rad, to angle_
    double measure_ = 0;
    int agreed_ = 0;
  };

  Axis pan_;
  Axis tilt_;
};

}  // namespace alidade
