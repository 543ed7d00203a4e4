#pragma once
// Where the zoom's motor stands at any time: movements and rests, in log f of the lens' own curve (zoom_curve.h).
//
//   still   at one reading
//   dwell   rests at each stop, moving between them as fast as the motor can; after the last to the first again, where it waits
//           until the round is over
//   sweep   the focal length times `factor` in `duration`, a rest, back, a rest
//   creep   the same at a steady, slow rate
//   csv     columns time_s, zoom: a monotone cubic of log f through the points (Fritsch and Carlson 1980); equal neighbours
//           are a rest. A truth.csv will do, if the motor is granted a fifth more acceleration: a cubic has its own
//
// A movement of the first four kinds starts and ends at rest: its rate rises as sin^2 to its speed, stays, and falls likewise.
// No path exceeds the motor's speed and acceleration: one that would is refused.
// Time is seconds of the simulation. Thread-safe, no allocation in at().

#include <cstdint>
#include <memory>

#include "test/simulator/zoom_config.h"

namespace alidade::simulator {

// The motor at one time. Movements are numbered in the order of time, those before time 0 of a path that repeats below 0.
struct ZoomPosition {
  double log_focal_length = 0;
  std::int64_t movement = -1;  // that is under way, or was last
  double done = 1;             // part of it, 0 to 1
};

// How the motor covers a distance from rest to rest.
struct MotorMove {
  double distance = 0;  // 0 or more
  double speed = 1;     // 1/s, the highest
  double ramp = 0;      // s, of the rise and of the fall of the rate

  [[nodiscard]] double duration() const { return distance / speed + ramp; }
  // After `time` seconds.
  [[nodiscard]] double covered(double time) const;
};

class ZoomPath {
 public:
  virtual ~ZoomPath() = default;
  [[nodiscard]] virtual ZoomPosition at(double time_s) const = 0;
  // After how many seconds the motor's path repeats; 0: it does not.
  [[nodiscard]] virtual double period_s() const = 0;
  [[nodiscard]] virtual bool moves() const = 0;
  // 1: a movement to longer focal lengths, -1: to shorter ones. That before the first: as that.
  [[nodiscard]] virtual int direction(std::int64_t movement) const = 0;
  // Movements of a round; 0: there are no rounds.
  [[nodiscard]] virtual std::int64_t movements_per_round() const = 0;
  // Least and most log f.
  [[nodiscard]] virtual ZoomConfig::Ends extent() const = 0;
};

// Throws std::invalid_argument if the motor or the range does not allow the path, ConfigError for a CSV file, with file and line.
[[nodiscard]] std::shared_ptr<const ZoomPath> make_zoom_path(const ZoomConfig& config);

}  // namespace alidade::simulator
