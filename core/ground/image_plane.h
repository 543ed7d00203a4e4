#pragma once
// From an image to the plane and back, each pixel at its own row's time, with all uncertainties.
// No allocation.
//   pixel -> direction (rolling_shutter.h) -> plane, cov_X = J (cov_u + cov_frame) J^T + plane's
//   point -> direction -> pixel, solved for its row
// cov_frame is FrameOrientation's: motion and calibration, with the effect of the calibration on
// the motion. The plane's errors are taken as independent of the frame's. One way is the inverse of
// the other, to rounding. Outputs are written with kOk only.

#include "core/ground/world_plane.h"
#include "core/realtime/frame_orientation.h"

namespace alidade {

// u: px. cov_u: px^2.
[[nodiscard]] PlaneStatus plane_point_of_pixel(const WorldPlane& plane,
                                               const FrameOrientation& frame,
                                               const Vector2<double>& u,
                                               const Matrix2<double>& cov_u,
                                               const PlaneLimits& limits, PlanePoint* out);

// The place only: m, X and Y in w.
[[nodiscard]] PlaneStatus plane_point_of_pixel(const WorldPlane& plane,
                                               const FrameOrientation& frame,
                                               const Vector2<double>& u, Vector2<double>* X);

// Where a point of w is seen; the pixel may lie outside the image.
struct PlanePixel {
  Vector2<double> u;           // px
  Matrix<double, 2, 3> J_u_P;  // px/m
  Matrix2<double> covariance;  // px^2, from frame and plane; the point itself is taken as exact
};

// P_w: m.
[[nodiscard]] PlaneStatus pixel_of_point(const WorldPlane& plane, const FrameOrientation& frame,
                                         const Vector3<double>& P_w, PlanePixel* out);

// The pixel only.
[[nodiscard]] PlaneStatus pixel_of_point(const WorldPlane& plane, const FrameOrientation& frame,
                                         const Vector3<double>& P_w, Vector2<double>* u);

}  // namespace alidade
