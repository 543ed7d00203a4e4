#pragma once
// How each departure would shift frames and parameters: the columns that model_check.h tests. The
// departure of a parameter shifts the parameter. A gear, a play or a drift shifts an angle (rad) or
// f (px) of each frame, given for an amplitude of 1. Jitter and noise shift each frame by chance.
// Allocates.

#include <Eigen/Core>
#include <vector>

#include "edge_app/verify/model_check.h"
#include "edge_app/verify/seen_frame.h"

namespace alidade {

inline constexpr int kFrameErrors = 4;  // pan, tilt, their rates

// A column that shifts one quantity of each frame by a known number.
struct FrameColumn {
  enum class What { kPan, kTilt, kFocalLength } what = What::kPan;
  std::vector<double> of_frame;  // by frame: the shift for an amplitude of 1; rad, or px of f
};

// Of a frame's errors: their covariance grows by a^2 times this one's square B B^T, a the amplitude.
using FrameNoise = Eigen::Matrix<double, kFrameErrors, 2>;

struct DepartureColumns {
  Departure departure;
  std::vector<int> parameters;       // indices of Parameter; or else
  std::vector<FrameColumn> columns;  // shifts of frames
  std::vector<double> at;            // of a curve: its knots, rad or s, one for each column
  std::vector<FrameNoise> noise;     // or else, by frame
  [[nodiscard]] int count() const { return static_cast<int>(parameters.size() + columns.size()); }
};

// In the order of Departure. A curve has no columns if the frames' angles or times range over less
// than 1e-3 rad or s.
[[nodiscard]] std::vector<DepartureColumns> all_departures(const std::vector<SeenFrame>& frames);

}  // namespace alidade
