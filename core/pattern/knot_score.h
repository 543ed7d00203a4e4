#pragma once
// Does the pose curve need more knots, and where? A score test: halve segments in mind, and ask the residuals at hand by how
// much the sum of their squares would fall (one Gauss-Newton step of the curve alone, the lens held). Each new knot adds six
// unknowns, so pure noise gives chi-square with six degrees of freedom a segment: more says that the motion is not followed.
// It sharpens (Oth, section 4.2), whose test of a segment's whole cost drowns a bias of every residual in the noise of all of
// them; and it ends, since a segment is only halved where half is at least the shortest useful length: beyond two knots a
// frame the curve follows the noise and the line delay's sigma collapses.

#include <vector>

#include "core/pattern/pattern_adjustment.h"

namespace alidade::internal {

struct KnotScoreOptions {
  double sigma_px = 1;  // of an observation's coordinate
  double shortest_frames =
      0.5;  // no half may be shorter, counted in frames that show the pattern there
};

struct KnotScore {
  std::vector<int> split;    // segments to halve, in increasing order
  double gain = 0;           // of squared residuals in units of sigma, were all that can be halved
  double expected = 0;       // from noise alone
  double gain_of_short = 0;  // were those halved that are too short for it
  double expected_of_short = 0;
};

[[nodiscard]] KnotScore score_knots(const PatternData& data, const PatternMask& used,
                                    const PatternState& state, const KnotScoreOptions& options);

// sigma of an observation's coordinate, px: what one step of a curve with a knot a frame leaves, whatever the knots of the
// state's own curve do not follow.
[[nodiscard]] double observation_noise(const PatternData& data, const PatternMask& used,
                                       const PatternState& state, double frame_interval_s);

}  // namespace alidade::internal
