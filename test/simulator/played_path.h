#pragma once
// A head whose gear has play (backlash): a path that follows another one through the hysteresis
// operator, for each axis
//
//   y = play(x; b)   y stands still while x stays within b / 2 of it, and else is dragged along at
//                    that distance
//
// Encoder on the motor: the given path is the motor's, which the encoder sees; the camera is
// dragged. Encoder on the output: the given path is the camera's; the reading is dragged. The state
// begins in the middle; on a path that repeats it is that of any later round. It is kept at each
// millisecond (of hours, less often) and exact in between, except at a turn-about: the error is at
// most acceleration * step^2 / 8.

#include <cstddef>
#include <memory>
#include <vector>

#include "test/simulator/path.h"

namespace alidade::simulator {

class PlayedPath : public Path {
 public:
  PlayedPath(std::unique_ptr<Path> driven, const PlayConfig& play);

  [[nodiscard]] Angles at(double time_s) const override;
  [[nodiscard]] Angles encoder_at(double time_s) const override;
  [[nodiscard]] double period_s() const override { return driven_->period_s(); }

 private:
  [[nodiscard]] Angles dragged_at(double time_s) const;

  std::unique_ptr<Path> driven_;
  PlayConfig play_;
  double begin_, step_;  // s
  std::vector<Angles> states_;
};

}  // namespace alidade::simulator
