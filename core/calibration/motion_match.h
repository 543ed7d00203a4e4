#pragma once
// Clock offset and focal length from motion alone, without a guess. Over some 0.5 s the image moves
// by
//   (-f cos(tilt) dpan, f dtilt)        px right and down, angles in rad.
// The clock offset is the shift of time at which the tracks' median motion correlates best with
// the telemetry's. f is the ratio of the two motions at the best shift. Medians and the normalised
// correlation need neither a guess of f nor clean tracks. Small tilt and nominal axes are assumed.
// The result is good to some percent; the robust adjustment removes this error. Allocates.

#include <array>
#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

// The median motion of the tracks from one frame to another.
struct ImageMotion {
  double from_s = 0;      // image clock
  double to_s = 0;        // image clock
  Vector2<double> shift;  // px
};

// Motions over about baseline_s, one for each frame from which a chain of frames leads so far.
// Neighbours in a chain share three landmarks or more.
[[nodiscard]] std::vector<ImageMotion> image_motion(const AdjustmentData& data, double baseline_s);

// By the motions about one axis alone.
struct AxisMatch {
  double focal_length = 0;  // px; 0: it did not move; negative: it moved against the telemetry
  double sigma = 0;         // px, by the image motion that focal_length does not explain
};

struct MotionMatch {
  double shift_s = 0;                // telemetry time = image time + shift_s
  double focal_length = 0;           // px
  std::array<AxisMatch, 2> by_axis;  // pan, tilt
  double correlation = 0;   // of the motions, 1 = perfect; 0: no match, shift and f mean nothing
  bool at_edge = false;     // the best shift is at an end of the range that was searched
  bool apart = false;       // at every shift fewer than half of the image's motions have telemetry
  double centre_s = 0;      // centre of the search
  double half_range_s = 0;  // of the search
};

// The best shift within half_range_s of centre_s, to 0.1 ms; with at_edge it may lie up to 0.03 s
// beyond. telemetry: measured angles over the telemetry clock. signs: factors of pan and tilt; -1
// reverses an axis.
[[nodiscard]] MotionMatch match_motion(const std::vector<ImageMotion>& motion,
                                       const TrajectorySpline& telemetry, double centre_s,
                                       double half_range_s, const Vector2<double>& signs = {1, 1});

// Axes whose telemetry counts opposite to the image's motion.
struct ReversedAxes {
  bool pan = false;
  bool tilt = false;
};

// The axes whose reversal leaves at most a third of what is unexplained without it, 1 -
// correlation^2. match: the result without reversal. An axis is reversed only if then the whole
// motions of image and telemetry correlate by 0.9 or more, and those about this axis by 0.8 or
// more. Takes three times as long as match_motion().
[[nodiscard]] ReversedAxes reversed_axes(const std::vector<ImageMotion>& motion,
                                         const TrajectorySpline& telemetry,
                                         const MotionMatch& match);

}  // namespace alidade::internal
