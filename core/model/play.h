#pragma once
// Play (backlash) of width b between two angles: the driver d, and the angle that it drags.
//   dragged = d - (b / 2) h,   h_i = clip(h_(i-1) + 2 (d_i - d_(i-1)) / b, -1, 1)
// Encoder on the motor: the reading drives, the camera is dragged. Encoder behind the gear: the
// camera drives, the reading is dragged. h is the state: at first anywhere in [-1, 1]. Each
// movement narrows this interval; a movement by b in one direction makes h known. Angles are rad,
// any turn. Differences go the short way round, so consecutive angles must be less than half a turn
// apart. Plain values; no allocation.

#include <algorithm>
#include <cmath>

#include "core/model/angle.h"

namespace alidade {

enum class PlayKind {
  kNone,
  kMotor,  // encoder on the motor: the camera stands still while the reading crosses the play
  kOutput  // encoder behind the gear: the reading stands still while the camera crosses the play
};

struct Play {
  double width_rad = 0;  // b, >= 0
  double sigma_rad = 0;  // of b
  PlayKind kind = PlayKind::kNone;

  [[nodiscard]] bool exists() const { return kind != PlayKind::kNone && width_rad > 0; }
};

// One of the two angles, computed from the other one.
struct PlayedAngle {
  double angle = 0;      // rad, in the same turn as the given angle
  double sigma_rad = 0;  // due to the state, the width and the noise
  int direction = 0;     // d angle / d b = -direction / 2 (dragged), direction / 2 (driver)
};

// The dragged angle, computed from the driver's.
class DraggedAngle {
 public:
  explicit DraggedAngle(const Play& play = {}) : play_(play) {}

  // noise_rad: sigma of one value of the driver. Peaks of the noise move the state, too.
  [[nodiscard]] PlayedAngle next(double driver, double noise_rad = 0) {
    const double b = play_.width_rad;
    if (!(b > 0)) return {driver, 0, 0};
    const double moved = begun_ ? wrap_angle(driver - driver_) : 0;
    if (moved != 0) push(2 * moved / b);
    driver_ = driver;
    begun_ = true;
    const double half = (high_ - low_) / 2;
    const double inside = 1 - at_low_ - at_high_;
    const double off = (at_high_ - at_low_) * half;  // mean of h, from the middle
    const double variance = std::max(0.0, (1 - inside + inside / 3) * half * half - off * off);
    const bool pushes = half == 0 && std::abs(low_) == 1 && std::abs(moved) >= kClear * noise_rad;
    const double by_width = direction_ != 0 ? play_.sigma_rad / 2 : 0;
    const double by_noise = pushes ? 0 : kPeak * noise_rad;
    return {driver - b / 2 * ((low_ + high_) / 2 + off),
            std::sqrt(b * b / 4 * variance + by_width * by_width + by_noise * by_noise),
            half == 0 ? direction_ : 0};
  }
  // The state is unknown from here on: samples were lost, or the head was switched off.
  void forget() { *this = DraggedAngle(play_); }

 private:
  static constexpr double kClear = 3;  // sigmas; noise alone makes no larger movement
  static constexpr double kPeak = 2;   // sigmas; peak of the noise that moved a resting state

  // What is pushed beyond one end of [-1, 1] gathers at that end.
  void push(double by) {
    double* end = by > 0 ? &high_ : &low_;
    double* gathered = by > 0 ? &at_high_ : &at_low_;
    const double width = high_ - low_;
    low_ += by;
    high_ += by;
    const double beyond = std::abs(*end) - 1;
    if (beyond < 0) return;
    direction_ = by > 0 ? 1 : -1;
    if (beyond >= width) {
      low_ = high_ = direction_;
      return;
    }
    *gathered += (1 - at_low_ - at_high_) * beyond / width;
    *end = direction_;
  }

  Play play_;
  double driver_ = 0;
  double low_ = -1;  // h lies between these two, anywhere or, with these probabilities, at the ends
  double high_ = 1;
  double at_low_ = 0;
  double at_high_ = 0;
  int direction_ = 0;  // in which the driver pushed last
  bool begun_ = false;
};

// The driver, computed from the dragged angle. While the dragged angle stands still, the driver may
// be anywhere within the play.
class DrivingAngle {
 public:
  explicit DrivingAngle(const Play& play = {}) : play_(play) {}

  // noise_rad: sigma of one value of the dragged angle. A movement that noise can make does not
  // count.
  [[nodiscard]] PlayedAngle next(double dragged, double noise_rad = 0) {
    const double b = play_.width_rad;
    if (!(b > 0)) return {dragged, 0, 0};
    const double moved = begun_ ? wrap_angle(dragged - dragged_) : 0;
    const bool pushes = std::abs(moved) > kClear * noise_rad;
    if (pushes) direction_ = moved > 0 ? 1 : -1;
    dragged_ = dragged;
    begun_ = true;
    if (pushes) return {dragged + direction_ * b / 2, play_.sigma_rad / 2, direction_};
    // Either the driver still stands where it pushed, or it is on its way back: half-way is near
    // both.
    return {dragged + direction_ * b / 4, b / std::sqrt(12.0), 0};
  }
  void forget() { *this = DrivingAngle(play_); }

 private:
  static constexpr double kClear = 6;  // 4 sigmas of a difference of two values

  Play play_;
  double dragged_ = 0;
  int direction_ = 0;  // in which the driver pushed last; 0: unknown
  bool begun_ = false;
};

// The true angle, computed from readings, for each kind of play. next() takes each reading once, in
// order, after scale and error curve were removed.
class PlayOfReadings {
 public:
  explicit PlayOfReadings(const Play& play = {})
      : kind_(play.exists() ? play.kind : PlayKind::kNone), dragged_(play), driver_(play) {}

  [[nodiscard]] PlayedAngle next(double reading, double noise_rad) {
    if (kind_ == PlayKind::kMotor) return dragged_.next(reading, noise_rad);
    if (kind_ == PlayKind::kOutput) return driver_.next(reading, noise_rad);
    return {reading, 0, 0};
  }
  void forget() {
    dragged_.forget();
    driver_.forget();
  }

 private:
  PlayKind kind_;
  DraggedAngle dragged_;
  DrivingAngle driver_;
};

}  // namespace alidade
