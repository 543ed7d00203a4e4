#pragma once
// score_knots(): whether and where the pose curve needs more knots. A score test: by how much would
// the sum of squared residuals fall if segments were halved (one Gauss-Newton step of the curve
// alone, the lens held)? Each knot adds six unknowns, so pure noise gives a chi-square of six
// degrees of freedom a segment. A larger gain means that the curve does not follow the motion.
// (Oth, section 4.2) tests a segment's whole cost, in which noise drowns a bias that all residuals
// share. Halves have a least length, so that splitting ends: with more than two knots a frame the
// curve follows noise, and the line delay's sigma collapses.

#include <vector>

#include "core/pattern/pattern_adjustment.h"

namespace alidade::internal {

struct KnotScoreOptions {
  double sigma_px = 1;  // of an observation's coordinate, > 0
  // Least length of a half, in frames that show the pattern there.
  double shortest_frames = 0.5;
};

// A segment with fewer than 12 observations counts nowhere.
struct KnotScore {
  std::vector<int> split;    // segments to halve, in increasing order
  double gain = 0;           // fall of the sum of squares (sigma^2) if all long enough were halved
  double expected = 0;       // of gain, from noise alone
  double gain_of_short = 0;  // the same for the segments that are too short to be halved
  double expected_of_short = 0;
};

[[nodiscard]] KnotScore score_knots(const PatternData& data, const PatternMask& used,
                                    const PatternState& state, const KnotScoreOptions& options);

// sigma of an observation's coordinate, px: what one step of a curve with one knot a frame leaves.
// It does not depend on motion that the state's own curve does not follow. 0 if there are too few
// observations. frame_interval_s: s, > 0.
[[nodiscard]] double observation_noise(const PatternData& data, const PatternMask& used,
                                       const PatternState& state, double frame_interval_s);

}  // namespace alidade::internal
