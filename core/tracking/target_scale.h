#pragma once
// How large an upright target of a given height is in the picture, at any pixel: what a detector needs to look at one scale only
// (Lisanti et al., section 4.1).
//   foot pixel -> plane point X (image_plane.h), head pixel = pixel of (X, height)
// Distortion and the rows are in it. Rolling shutter plays no part worth a thought: foot and head are exposed (foot row - head row)
// line_delay apart, in which a camera that pans half a field of view a second moves the head against the foot, sideways, by 3 % of the
// target's height at most, and changes that height by 0.2 % (target_scale_test). The paper's homology W (plane_homography.h) gives the same
// for a camera with neither. No allocation.

#include "core/ground/world_plane.h"
#include "core/realtime/frame_orientation.h"

namespace alidade {

struct UprightTarget {
  Vector2<double> foot_u;    // px
  Vector2<double> head_u;    // px, inside the image or not
  Vector2<double> position;  // m, of the foot in w
  double height_px = 0;      // |head_u - foot_u|
};

// height_m: above 0. kNoDirection: the head reaches behind the camera, or has no pixel.
[[nodiscard]] PlaneStatus upright_target(const WorldPlane& plane, const FrameOrientation& frame,
                                         const Vector2<double>& foot_u, double height_m,
                                         UprightTarget* out);

}  // namespace alidade
