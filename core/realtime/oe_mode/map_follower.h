#pragma once
// MapFollower: the map's offset while the map may be going along with what moves. Telemetry takes
// seconds to show what is ground and what are clouds. Meanwhile a map bends by some tenths of a
// pixel, and no constant offset holds for it. So for a while after something was seen to move the
// offset is that of the last half second alone: a straight line through telemetry's angle minus the
// map's, whose rate may be as large as that of what moves. Fixed memory, no allocation. One thread.

#include <array>
#include <limits>

#include "core/model/linear_algebra.h"
#include "core/realtime/oe_mode/fading_fit.h"
#include "core/realtime/oe_mode/scene_drift.h"

namespace alidade {

struct FollowedOffset {
  Vector2<double> value = Vector2<double>::Zero();     // rad, (pan, tilt)
  Vector2<double> variance = Vector2<double>::Zero();  // rad^2, of telemetry's noise
};

class MapFollower {
 public:
  // For another calibration.
  void reset() { *this = {}; }
  // The map begins anew.
  void begin_map() { lines_ = {}; }

  // Ignored if not finite, or without variance.
  void note(const SeenOffset& seen);
  // Something was seen to move. rate: rad/s.
  void note_moving(double time_s, double rate);

  // The map was moved, so that its offset is larger by this.
  void move_offset(const Vector2<double>& by);

  // False if nothing was seen to move lately, or the map is too new; *out is then not to be used.
  // pixel: rad, the angle of one pixel.
  [[nodiscard]] bool follow(double time_s, double pixel, FollowedOffset* out) const;

 private:
  static constexpr double kNever = -std::numeric_limits<double>::infinity();

  std::array<FadingFit<2>, 2> lines_;  // of each axis: offset = a + b (t - begun)
  double begun_s_ = 0;
  double noted_s_ = 0;
  double moved_s_ = kNever;
  double rate_ = 0;  // rad/s, of what moved
};

}  // namespace alidade
