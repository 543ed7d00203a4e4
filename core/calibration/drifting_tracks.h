#pragma once
// What moves in the picture: tracks of clouds, waves or traffic that drift against telemetry, told
// from the ground before anything is adjusted. Tracks of the same time fall into groups, each of
// one rate. Telemetry fits best if the group of the ground is taken to be at rest (drift_fit.h, sum
// of squares), even if it is the smaller one. Departures from the model (parallax, gears) make
// groups, too, but such a group changes its rate: only a group that keeps its rate drifts. Rates in
// rad/s. Allocates.

#include <optional>
#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/linearisation.h"

namespace alidade::internal {

enum class DriftFinding {
  kNone,       // one group, at rest as far as can be seen
  kGroup,      // a group drifts against the ground
  kUndecided,  // two groups, and telemetry fits neither better
  kAll         // nothing that was tracked is at rest
};

struct DriftingTracks {
  DriftFinding finding = DriftFinding::kNone;
  std::vector<char> drifts;                        // by landmark; 1: drifts
  int count = 0;                                   // of landmarks that drift
  Vector2<double> rate = Vector2<double>::Zero();  // of the group, (pan, tilt)
};

// state: near the minimum. resolution_rad: the step of telemetry's angles, within which everything
// may seem to drift; 0: no steps. Takes some solutions of the adjustment's size. A recording of
// more than some minutes is not examined: kNone. The data's marks stay.
[[nodiscard]] DriftingTracks find_drifting_tracks(AdjustmentData* data,
                                                  const AdjustmentState& state,
                                                  double resolution_rad, Adjustment* adjustment);

}  // namespace alidade::internal
