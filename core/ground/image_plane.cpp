#include "core/ground/image_plane.h"

#include "core/model/direction.h"

namespace alidade {

PlaneStatus plane_point_of_pixel(const WorldPlane& plane, const FrameOrientation& frame,
                                 const Vector2<double>& u, const Matrix2<double>& cov_u,
                                 const PlaneLimits& limits, PlanePoint* out) {
  Vector3<double> d_b;
  Matrix2<double> cov_d;
  Matrix<double, 3, 2> J_d_u;
  if (frame.direction(u, &d_b, &cov_d) != ProjectionStatus::kOk ||
      rolling_shutter_unproject(frame.calibration.camera, frame.calibration.mechanics,
                                frame.calibration.line_delay, frame.motion(), u, &d_b,
                                &J_d_u) != ProjectionStatus::kOk) {
    return PlaneStatus::kNoDirection;
  }
  const Matrix2<double> J_tangent_u = tangent_basis(d_b).transpose() * J_d_u;
  cov_d += J_tangent_u * cov_u * J_tangent_u.transpose();
  return plane_point(plane, d_b, cov_d, limits, out);
}

PlaneStatus plane_point_of_pixel(const WorldPlane& plane, const FrameOrientation& frame,
                                 const Vector2<double>& u, Vector2<double>* X) {
  Vector3<double> d_b;
  if (frame.direction(u, &d_b) != ProjectionStatus::kOk) return PlaneStatus::kNoDirection;
  return plane_point(plane, d_b, X);
}

PlaneStatus pixel_of_point(const WorldPlane& plane, const FrameOrientation& frame,
                           const Vector3<double>& P_w, PlanePixel* out) {
  Vector3<double> d_b;
  Matrix3<double> J_d_P;
  Matrix<double, 3, kPlaneParameterCount> J_d_plane;
  const PlaneStatus status = direction_of(plane, P_w, &d_b, &J_d_P, &J_d_plane);
  if (status != PlaneStatus::kOk) return status;
  PlanePixel pixel;
  Matrix<double, 2, 3> J_u_d;
  if (frame.pixel(d_b, &pixel.u, &pixel.covariance) != ProjectionStatus::kOk ||
      rolling_shutter_project(frame.calibration.camera, frame.calibration.mechanics,
                              frame.calibration.line_delay, frame.motion(), d_b, &pixel.u,
                              &J_u_d) != ProjectionStatus::kOk) {
    return PlaneStatus::kNoDirection;
  }
  pixel.J_u_P = J_u_d * J_d_P;
  const Matrix<double, 2, kPlaneParameterCount> J_u_plane = J_u_d * J_d_plane;
  pixel.covariance += J_u_plane * plane.covariance * J_u_plane.transpose();
  *out = pixel;
  return PlaneStatus::kOk;
}

PlaneStatus pixel_of_point(const WorldPlane& plane, const FrameOrientation& frame,
                           const Vector3<double>& P_w, Vector2<double>* u) {
  Vector3<double> d_b;
  const PlaneStatus status = direction_of(plane, P_w, &d_b);
  if (status != PlaneStatus::kOk) return status;
  return frame.pixel(d_b, u) == ProjectionStatus::kOk ? PlaneStatus::kOk
                                                      : PlaneStatus::kNoDirection;
}

}  // namespace alidade
