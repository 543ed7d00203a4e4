#pragma once
// The true pan and tilt angle at any time: the path the virtual camera follows.
//
// at() is a smooth closed form for any moment, so that every row of every frame and every telemetry
// sample gets the angle of its own time. Angles are rad, unwrapped (they may pass pi); time is
// seconds of the simulation (0 = start of the first frame). Thread-safe, no allocation in at().
//
// s = horizontal field of view, a = amplitude, T = period:
//   triple_cosine  pan = a 9 s sin(2 pi t / T) / (2 pi), tilt = -a 3 s cos(6 pi t / T) / (2 pi):
//                  the "triple infinity" of the PTCEE paper
//   sweep          round a rectangle 3 a s wide and a s high: right, up, left, down, a quarter of T
//                  each, the last stop_s of each quarter at rest
//   jerky          quick moves with rests between random points of that rectangle; repeats after T
//   csv            columns time_s, pan_rad, tilt_rad (a truth.csv will do), cubic Hermite
//
// All but csv may follow the zoom: s is then the field of view of that moment.

#include <memory>

#include "test/simulator/config.h"

namespace alidade::simulator {

inline constexpr double kTwoPi = 6.28318530717958647692;

struct Angles {
  double pan = 0;   // rad, positive to the right
  double tilt = 0;  // rad, positive up
};

class Path {
 public:
  virtual ~Path() = default;
  [[nodiscard]] virtual Angles at(double time_s) const = 0;
  // What the head's encoders see then: the same, but for play (played_path.h).
  [[nodiscard]] virtual Angles encoder_at(double time_s) const { return at(time_s); }
  // After how many seconds the path repeats; 0 if it does not.
  [[nodiscard]] virtual double period_s() const = 0;
  // Of a path that does not repeat: before and after it rests.
  struct Span {
    double from = 0, to = 0;  // s
  };
  [[nodiscard]] virtual Span moving() const { return {}; }
};

// The camera's, after the play that telemetry states. Throws ConfigError if a CSV file cannot be
// read; the text names file and line.
[[nodiscard]] std::unique_ptr<Path> make_path(const Config& config);

}  // namespace alidade::simulator
