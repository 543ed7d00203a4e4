#pragma once
// MovingDirections: directions in which something was seen to move (clouds, water, traffic),
// remembered for kRemembered_s. Each direction goes on at the rate that was seen. No landmark is
// made there. Fixed memory: the oldest is replaced. No allocation. One thread.

#include <array>
#include <cstddef>

#include "core/model/linear_algebra.h"

namespace alidade {

class MovingDirections {
 public:
  static constexpr std::size_t kCapacity = 512;
  static constexpr double kRemembered_s = 20;

  void clear() { count_ = 0; }

  // d: unit. rate: rad/s, (pan, tilt) by which the camera would have to turn for the same change in
  // the image. radius: rad. Ignored if d or rate is not finite.
  void add(const Vector3<double>& d, const Vector2<double>& rate, double radius, double time_s);

  // True if d is within the radius of a remembered direction, moved on to time_s (s, image clock).
  [[nodiscard]] bool contains(const Vector3<double>& d, double time_s) const;

 private:
  struct Mark {
    Vector2<double> place;  // rad, azimuth and elevation
    Vector2<double> rate;   // rad/s, of the camera
    double radius = 0;
    double time_s = 0;
  };

  std::array<Mark, kCapacity> marks_{};  // ring buffer
  std::size_t next_ = 0;
  std::size_t count_ = 0;
};

}  // namespace alidade
