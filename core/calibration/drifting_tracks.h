#pragma once
// What moves in the picture: tracks of clouds, waves or traffic that drift against telemetry are
// separated from the ground, after a robust adjustment. Tracks of the same time fall into groups,
// each of one rate. Telemetry fits best if the group of the ground is taken to be at rest
// (drift_fit.h, sum of squares), even if it is the smaller one. Departures from the model
// (parallax, gears) make groups, too, but such a group changes its rate: only a group that keeps
// its rate drifts. Rates in rad/s, as in drift_fit.h. Allocates. More: docs/calibration.md.

#include <optional>
#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/linearisation.h"

namespace alidade::internal {

enum class DriftFinding {
  kNone,       // no drift that would do harm was found, or nothing could be examined
  kGroup,      // a group drifts against the ground
  kUndecided,  // two groups, and telemetry does not show which of them is at rest
  kAll         // one group, and it drifts
};

struct DriftingTracks {
  DriftFinding finding = DriftFinding::kNone;
  // One for each landmark. 1, only with kGroup: it is not at rest, or it fits the drift of the
  // group as well as rest.
  std::vector<char> drifts;
  int count = 0;                                   // of landmarks marked so
  Vector2<double> rate = Vector2<double>::Zero();  // of what drifts; meaningless with kNone
};

// state: near the minimum. resolution_rad: the step of telemetry's angles; all that is in view must
// drift by more than two of them to be kAll; 0: no steps. Takes some solutions of the adjustment's
// size. A trajectory of more than 600 control points, some minutes, is not examined: kNone. `used`
// of the observations is changed during the call and restored.
[[nodiscard]] DriftingTracks find_drifting_tracks(AdjustmentData* data,
                                                  const AdjustmentState& state,
                                                  double resolution_rad, Adjustment* adjustment);

}  // namespace alidade::internal
