#pragma once
// By what each departure would shift frames and parameters: the columns that model_check.h tests.
// A parameter's column is its own; those of gears, play and drifts are told frame by frame, rad or
// relative, for an amplitude of 1. Allocates.

#include <vector>

#include "edge_app/verify/model_check.h"
#include "edge_app/verify/seen_frame.h"

namespace alidade {

// A column that shifts a frame's angles or parameter by a known number.
struct FrameColumn {
  enum class What { kPan, kTilt, kFocalLength } what = What::kPan;
  std::vector<double> of_frame;  // for an amplitude of 1
};

struct DepartureColumns {
  Departure departure;
  std::vector<int> parameters;  // of Parameter; or
  std::vector<FrameColumn> columns;
  std::vector<double> at;
  [[nodiscard]] int count() const { return static_cast<int>(parameters.size() + columns.size()); }
};

// In the order of Departure. A curve has none where the frames do not range over its knots.
[[nodiscard]] std::vector<DepartureColumns> all_departures(const std::vector<SeenFrame>& frames);

}  // namespace alidade
