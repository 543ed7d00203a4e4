#pragma once
// From a picture to the plane and back: each pixel at its own row's time, with everything that makes it uncertain.
//   pixel -> direction at its row (rolling_shutter.h) -> plane,   cov_X = J (cov_pixel + cov_frame) J^T + cov_plane's part
//   point -> direction -> pixel, whose row is solved for
// cov_frame is that of FrameOrientation: the motion's and the calibration's, with what the calibration did to the motion. The
// plane's errors are taken as independent of the frame's. The two ways are inverse to rounding. No allocation.

#include "core/ground/world_plane.h"
#include "core/realtime/frame_orientation.h"

namespace alidade {

// cov_u: px^2.
[[nodiscard]] PlaneStatus plane_point_of_pixel(const WorldPlane& plane,
                                               const FrameOrientation& frame,
                                               const Vector2<double>& u,
                                               const Matrix2<double>& cov_u,
                                               const PlaneLimits& limits, PlanePoint* out);

// The place alone.
[[nodiscard]] PlaneStatus plane_point_of_pixel(const WorldPlane& plane,
                                               const FrameOrientation& frame,
                                               const Vector2<double>& u, Vector2<double>* X);

// Where a point of w is seen, inside the image or not.
struct PlanePixel {
  Vector2<double> u;           // px
  Matrix<double, 2, 3> J_u_P;  // px/m
  Matrix2<double> covariance;  // px^2, for an exactly known point: the frame's and the plane's
};
[[nodiscard]] PlaneStatus pixel_of_point(const WorldPlane& plane, const FrameOrientation& frame,
                                         const Vector3<double>& P_w, PlanePixel* out);

// The pixel alone.
[[nodiscard]] PlaneStatus pixel_of_point(const WorldPlane& plane, const FrameOrientation& frame,
                                         const Vector3<double>& P_w, Vector2<double>* u);

}  // namespace alidade
