#pragma once
// RenewalAge: how old a polled angle may be because the device renews it at moments of its own. A
// new angle was renewed since the poll before, so its age is uniform over that time. Its mean is
// part of the clock offset; its scatter is an error of each sample's time. A device is known to
// measure on request, or very often, once several polls in a row brought new angles, be it by noise;
// it is known to renew its angles as seldom as it is polled, or less often, once an angle came again
// while the head turned. Until either is known the age counts, too. Plain values; no allocation.
// One thread.

#include <cmath>

#include "core/model/angle.h"

namespace alidade {

class RenewalAge {
 public:
  // rad; a change of an angle that shows that the head turned, clear of noise (one sigma) and steps.
  [[nodiscard]] static double least_turn(double noise, double step) {
    constexpr double kTimes = 5;
    return kTimes * std::fmax(noise, step);
  }

  // least_rad: > 0, least_turn(). longest_s: an angle that stands for longer is that of a head at
  // rest. 0: each angle is known to be new.
  RenewalAge(double least_rad, double longest_s)
      : least_rad_(least_rad),
        longest_s_(longest_s),
        state_(longest_s > 0 ? State::kUnknown : State::kOnRequest) {}

  // The next poll's answer: time in s, ascending; rad, as measured, any turn. True if sigma_s() has
  // changed.
  bool add(double time_s, double pan, double tilt) {
    const PanTilt<double> moved{begun_ ? wrap_angle(pan - angle_.pan) : 0,
                                begun_ ? wrap_angle(tilt - angle_.tilt) : 0};
    if (begun_ && moved.pan == 0 && moved.tilt == 0) {
      repeated_ = true;
      if (state_ == State::kUnknown) new_in_a_row_ = 0;
      if (time_s - new_since_s_ > longest_s_ * kAlmost) moved_ = {};
      return false;
    }
    const bool turns_on = goes_on(moved_.pan, moved.pan) || goes_on(moved_.tilt, moved.tilt);
    const State before = state_;
    if (turns_on && repeated_) {
      state_ = State::kSeldom;
      new_in_a_row_ = 0;
    } else if (begun_ && ++new_in_a_row_ >= (state_ == State::kSeldom ? kMany : kEnough)) {
      state_ = State::kOnRequest;
    }
    begun_ = true;
    angle_ = {pan, tilt};
    moved_ = moved;
    new_since_s_ = time_s;
    repeated_ = false;
    return state_ != before;
  }

  // For a new connection. What is known of the device stays.
  void restart() {
    begun_ = false;
    moved_ = {};
    repeated_ = false;
    new_in_a_row_ = 0;
  }

  // Whether the device is known to renew its angles as seldom as it is asked, or less often.
  [[nodiscard]] bool is_seldom() const { return state_ == State::kSeldom; }

  // s, one standard deviation of the age of a new angle that came since_s after the poll before.
  [[nodiscard]] double sigma_s(double since_s) const {
    return state_ == State::kOnRequest ? 0 : std::fmin(since_s, longest_s_) / std::sqrt(12.0);
  }

 private:
  enum class State { kUnknown, kOnRequest, kSeldom };
  static constexpr int kEnough = 6;        // new angles in a row
  static constexpr int kMany = 60;         // new angles without a repeat in a turn
  static constexpr double kAlmost = 1.05;  // polls come a little early or late

  [[nodiscard]] bool goes_on(double before, double now) const {
    return before * now > 0 && std::fmin(std::abs(before), std::abs(now)) > least_rad_;
  }

  double least_rad_;
  double longest_s_;
  State state_;
  bool begun_ = false;
  PanTilt<double> angle_{0, 0};
  PanTilt<double> moved_{0, 0};  // to angle_; 0: the head rests
  double new_since_s_ = 0;
  bool repeated_ = false;  // angle_ has come again
  int new_in_a_row_ = 0;   // new angles, since the last repeat that counts
};

}  // namespace alidade
