#pragma once
// upright_target(): size in the image of an upright target of known height, by the pixel of its
// foot, so that a detector needs one scale only (Lisanti et al., section 4.1). Foot pixel -> plane
// point X (image_plane.h); head pixel = pixel of (X, height). Distortion and rows are included.
// Rolling shutter hardly matters: foot and head are exposed (foot row - head row) * line_delay
// apart. At half a field of view a second the head moves sideways against the foot by 3 % of the
// height at most, and the height changes by 0.2 % (target_scale_test). Without distortion and rows
// the result equals the paper's homology W (plane_homography.h). No allocation.

#include "core/ground/world_plane.h"
#include "core/realtime/frame_orientation.h"

namespace alidade {

struct UprightTarget {
  Vector2<double> foot_u;    // px
  Vector2<double> head_u;    // px; may be outside the image
  Vector2<double> position;  // m, of the foot in w
  double height_px = 0;      // |head_u - foot_u|
};

// foot_u: px. height_m: > 0. kNoDirection: the head is behind the camera, or has no pixel. Other
// failures as in plane_point_of_pixel(). *out is written with kOk only.
[[nodiscard]] PlaneStatus upright_target(const WorldPlane& plane, const FrameOrientation& frame,
                                         const Vector2<double>& foot_u, double height_m,
                                         UprightTarget* out);

}  // namespace alidade
