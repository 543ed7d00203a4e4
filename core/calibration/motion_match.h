#pragma once
// Clock offset and focal length from motion alone, without a guess. Over some 0.5 s the image moves
// by
//   (-f cos(tilt) dpan, f dtilt).
// The clock offset d is the shift of time at which the tracks' median motion correlates best with
// the telemetry's. f is the ratio of the two motions there. Medians and the normalised correlation
// need neither a guess of f nor clean tracks. Small tilt and nominal axes are assumed: good to some
// percent, which the robust adjustment removes. Allocates.

#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

// The median motion of the tracks from one frame to another.
struct ImageMotion {
  double from_s = 0;
  double to_s = 0;
  Vector2<double> shift;  // px
};

// Motions over about baseline_s, along chains of frames that share landmarks.
[[nodiscard]] std::vector<ImageMotion> image_motion(const AdjustmentData& data, double baseline_s);

struct MotionMatch {
  double shift_s = 0;  // telemetry time = image time + shift_s
  double focal_length = 0;
  double correlation = 0;  // of the motions, 1 = perfect
  bool at_edge = false;    // of the range that was searched
  bool apart = false;      // at each shift most of the image's motions lack telemetry
  double centre_s = 0;     // centre of the search
  double half_range_s = 0;
};

// The best shift within half_range_s of centre_s, to 0.1 ms. signs: factors of pan and tilt; -1
// reverses one.
[[nodiscard]] MotionMatch match_motion(const std::vector<ImageMotion>& motion,
                                       const TrajectorySpline& telemetry, double centre_s,
                                       double half_range_s, const Vector2<double>& signs = {1, 1});

// Axes whose telemetry counts opposite to the image's motion.
struct ReversedAxes {
  bool pan = false;
  bool tilt = false;
};

// The axes whose reversal explains much more of the image's motion. match: the result without
// reversal. None if the recording does not show it. Takes three times as long as
// match_motion().
[[nodiscard]] ReversedAxes reversed_axes(const std::vector<ImageMotion>& motion,
                                         const TrajectorySpline& telemetry,
                                         const MotionMatch& match);

}  // namespace alidade::internal
