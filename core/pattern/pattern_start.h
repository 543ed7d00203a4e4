#pragma once
// Start of the adjustment, by OpenCV: a lens by Zhang's method on slow and different views, a pose
// for each frame by PnP (both as if all rows were exposed at once: Oth, section 4.1), and the curve
// through the poses.

#include <optional>
#include <vector>

#include "core/pattern/pattern_adjustment.h"

namespace alidade::internal {

struct FramePose {
  int frame = 0;      // index into PatternData::frames
  double time_s = 0;  // exposure of the mean row of its observations
  Matrix3<double> R_pattern_from_camera = Matrix3<double>::Identity();
  Vector3<double> centre = Vector3<double>::Zero();  // of the camera, m, pattern frame
};

// Focal length and k1, with the optical centre in the image's middle and a line delay of 0; fixed
// parameters are at their mean. Empty if the views do not determine the lens.
[[nodiscard]] std::optional<LensVector> start_lens(const PatternData& data,
                                                   const LensKnowledge& knowledge);

// Poses of the frames that show enough of the pattern (six points), if one is found.
[[nodiscard]] std::vector<FramePose> start_poses(const PatternData& data, const LensVector& lens);

// Uniform knots about spacing_s apart, from margin_s before the first pose to margin_s after the
// last one. Needs two poses or more.
[[nodiscard]] PoseCurve start_curve(const std::vector<FramePose>& poses, double spacing_s,
                                    double margin_s);

}  // namespace alidade::internal
