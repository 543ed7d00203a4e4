#pragma once
// What moves in the picture: tracks of clouds, waves or traffic that drift against telemetry, told
// from the ground before anything is adjusted. The ground is what is at rest, be it the minority:
// tracks that were seen at the same times fall into groups of one rate each; of the groups that can
// be at rest together, telemetry fits one (drift_fit.h), by its sum of squares. Groups that differ
// by what departures from the model do (parallax, gears) drift this way and that: only what keeps
// its rate is a drift. Rates in rad/s. Allocates.

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
  std::vector<char> drifts;  // by landmark
  int count = 0;
  Vector2<double> rate = Vector2<double>::Zero();  // of the group, (pan, tilt)
};

// state: near the minimum. resolution_rad: telemetry's steps, within which all may seem to drift;
// 0: none. Takes some solutions of the adjustment's size; longer recordings than some minutes are
// not looked at. The data's marks stay.
[[nodiscard]] DriftingTracks find_drifting_tracks(AdjustmentData* data,
                                                  const AdjustmentState& state,
                                                  double resolution_rad, Adjustment* adjustment);

}  // namespace alidade::internal
