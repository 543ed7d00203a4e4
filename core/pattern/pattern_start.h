#pragma once
// Where the adjustment begins: a lens by Zhang's method on slow and different views, a pose a frame by PnP, both as if all rows
// were exposed at once (Oth, section 4.1), and the curve through the poses. By OpenCV.

#include <optional>
#include <vector>

#include "core/pattern/pattern_adjustment.h"

namespace alidade::internal {

struct FramePose {
  int frame = 0;      // index into PatternData::frames
  double time_s = 0;  // when the middle of its observations was exposed
  Matrix3<double> R_pattern_from_camera = Matrix3<double>::Identity();
  Vector3<double> centre = Vector3<double>::Zero();  // of the camera, m, pattern frame
};

// Focal length, optical centre and k1 with the parameters that knowledge fixes at its mean. Empty: the views do not determine it.
[[nodiscard]] std::optional<LensVector> start_lens(const PatternData& data,
                                                   const LensKnowledge& knowledge);

// Of each frame that shows enough of the pattern to have one.
[[nodiscard]] std::vector<FramePose> start_poses(const PatternData& data, const LensVector& lens);

// Uniform knots some spacing_s apart over all poses, with the rows' read-out at both ends. Two poses or more.
[[nodiscard]] PoseCurve start_curve(const std::vector<FramePose>& poses, double spacing_s,
                                    double margin_s);

}  // namespace alidade::internal
