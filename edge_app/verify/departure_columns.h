#pragma once
// How each departure would shift frames and parameters: the columns that model_check.h tests. The
// departure of a parameter shifts the parameter. A gear, a play or a drift shifts an angle (rad) or
// log f of each frame, given for an amplitude of 1. Allocates.

#include <vector>

#include "edge_app/verify/model_check.h"
#include "edge_app/verify/seen_frame.h"

namespace alidade {

// A column that shifts one quantity of each frame by a known number.
struct FrameColumn {
  enum class What { kPan, kTilt, kFocalLength } what = What::kPan;
  std::vector<double> of_frame;  // by frame: the shift for an amplitude of 1; rad, or 1 of log f
};

struct DepartureColumns {
  Departure departure;
  std::vector<int> parameters;       // indices of Parameter; or else
  std::vector<FrameColumn> columns;  // shifts of frames
  std::vector<double> at;            // of a curve: its knots, rad or s, one for each column
  [[nodiscard]] int count() const { return static_cast<int>(parameters.size() + columns.size()); }
};

// In the order of Departure. A curve has no columns if the frames' angles or times range over less
// than 1e-3 rad or s.
[[nodiscard]] std::vector<DepartureColumns> all_departures(const std::vector<SeenFrame>& frames);

}  // namespace alidade
