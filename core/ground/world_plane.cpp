#include "core/ground/world_plane.h"

#include <cmath>

#include "core/model/direction.h"
#include "core/model/rotation.h"

namespace alidade {
namespace {

Matrix3<double> about(int axis, double angle) {
  return rotation_about(Vector3<double>(Vector3<double>::Unit(axis)), angle);
}

// Of a level base: east-north-up to north-east-down, then the heading about down.
Matrix3<double> R_headed_from_world(double heading) {
  Matrix3<double> R_ned_from_enu;
  R_ned_from_enu << 0, 1, 0, 1, 0, 0, 0, 0, -1;
  return about(2, -heading) * R_ned_from_enu;
}

}  // namespace

const char* to_string(PlaneStatus status) {
  switch (status) {
    case PlaneStatus::kOk:
      return "ok";
    case PlaneStatus::kAboveHorizon:
      return "above the horizon";
    case PlaneStatus::kTooFar:
      return "too near the horizon: the place is too uncertain";
    case PlaneStatus::kCameraOnPlane:
      return "the camera is not above the plane";
    case PlaneStatus::kNoDirection:
      return "no direction or pixel belongs to it";
    case PlaneStatus::kNotFinite:
      return "not finite";
  }
  return "unknown status";
}

bool PlaneLimits::validate(const char** error) const {
  if (most_sigma_share > 0 && most_sigma_share < 1) return true;
  *error = "most_sigma_share is not between 0 and 1";
  return false;
}

double heading(const WorldPlane& plane) {
  const Vector3<double> forward_w = plane.R_base_from_world.row(0);
  if (!(forward_w.head<2>().norm() > kLeastForward)) return 0;
  return std::atan2(forward_w.x(), forward_w.y());
}

Vector3<double> heading_jacobian(const WorldPlane& plane) {
  const Vector3<double> forward_w = plane.R_base_from_world.row(0);
  const double square = forward_w.head<2>().squaredNorm();
  if (!(square > kLeastForward * kLeastForward)) return Vector3<double>::Zero();
  // d atan2(x, y) of forward_w, which changes by forward_w x xi.
  const Vector3<double> J_heading_forward(forward_w.y() / square, -forward_w.x() / square, 0);
  return skew(forward_w).transpose() * J_heading_forward;
}

Matrix3<double> R_base_from_world_of(double heading, double pitch, double roll) {
  return about(0, -roll) * about(1, -pitch) * R_headed_from_world(heading);
}

BaseAttitude base_attitude(const WorldPlane& plane) {
  BaseAttitude out;
  out.heading = heading(plane);
  // In the heading's frame, whose second axis is level: pitch of forward, then roll about it.
  const Matrix3<double> R = plane.R_base_from_world * R_headed_from_world(out.heading).transpose();
  out.pitch = std::atan2(-R(0, 2), R(0, 0));
  const Matrix3<double> rolled = R * about(1, -out.pitch).transpose();
  out.roll = std::atan2(rolled(1, 2), rolled(1, 1));
  return out;
}

Matrix3<double> attitude_jacobian(const BaseAttitude& attitude) {
  const Matrix3<double> R_headed = R_headed_from_world(attitude.heading);
  const Matrix3<double> R = R_base_from_world_of(attitude.heading, attitude.pitch, attitude.roll);
  Matrix3<double> J;
  J << Vector3<double>::UnitZ(), -R_headed.row(1).transpose(), -R.row(0).transpose();
  return J;
}

PlaneStatus plane_point(const WorldPlane& plane, const Vector3<double>& d_b, Vector2<double>* X,
                        Matrix<double, 2, 3>* J_X_d,
                        Matrix<double, 2, kPlaneParameterCount>* J_X_plane) {
  const Vector3<double> d_w = plane.R_base_from_world.transpose() * d_b;
  if (!all_finite(d_w) || !all_finite(plane.position)) return PlaneStatus::kNotFinite;
  if (!(plane.height() > 0)) return PlaneStatus::kCameraOnPlane;
  const double down = -d_w.z();
  if (!(down > 0)) return PlaneStatus::kAboveHorizon;
  const Vector2<double> slope = d_w.head<2>() / down;
  const Vector2<double> place = plane.position.head<2>() + plane.height() * slope;
  const double per_direction = plane.height() / down;
  Matrix<double, 2, 3> J_X_p;
  J_X_p << Matrix2<double>::Identity(), slope;
  const Matrix<double, 2, 3> J_X_dw = per_direction * J_X_p;
  if (!all_finite(place) || !all_finite(J_X_dw)) return PlaneStatus::kTooFar;
  *X = place;
  if (J_X_d != nullptr) *J_X_d = J_X_dw * plane.R_base_from_world.transpose();
  // d_w changes by -xi x d_w.
  if (J_X_plane != nullptr) *J_X_plane << J_X_dw * skew(d_w), J_X_p;
  return PlaneStatus::kOk;
}

PlaneStatus plane_point(const WorldPlane& plane, const Vector3<double>& d_b,
                        const Matrix2<double>& cov_d, const PlaneLimits& limits, PlanePoint* out) {
  PlanePoint point;
  Matrix<double, 2, 3> J_d;
  Matrix<double, 2, kPlaneParameterCount> J_plane;
  const PlaneStatus status = plane_point(plane, d_b, &point.position, &J_d, &J_plane);
  if (status != PlaneStatus::kOk) return status;
  const Matrix2<double> J_tangent = J_d * tangent_basis(d_b);
  point.covariance =
      J_tangent * cov_d * J_tangent.transpose() + J_plane * plane.covariance * J_plane.transpose();
  const Vector2<double> along = point.position - plane.position.head<2>();
  point.distance = std::hypot(along.norm(), plane.height());
  const double half_trace = point.covariance.trace() / 2;
  const double half_difference = (point.covariance(0, 0) - point.covariance(1, 1)) / 2;
  const double largest = half_trace + std::hypot(half_difference, point.covariance(0, 1));
  if (!std::isfinite(largest)) return PlaneStatus::kTooFar;
  if (std::sqrt(largest) > limits.most_sigma_share * point.distance) return PlaneStatus::kTooFar;
  *out = point;
  return PlaneStatus::kOk;
}

PlaneStatus direction_of(const WorldPlane& plane, const Vector3<double>& P_w, Vector3<double>* d_b,
                         Matrix3<double>* J_d_P,
                         Matrix<double, 3, kPlaneParameterCount>* J_d_plane) {
  const Vector3<double> from_camera = P_w - plane.position;
  const double distance = from_camera.norm();
  if (!std::isfinite(distance)) return PlaneStatus::kNotFinite;
  if (!(distance > 0)) return PlaneStatus::kNoDirection;
  const Vector3<double> d_w = from_camera / distance;
  *d_b = plane.R_base_from_world * d_w;
  if (J_d_P == nullptr && J_d_plane == nullptr) return PlaneStatus::kOk;
  const Matrix3<double> J_P =
      plane.R_base_from_world * (Matrix3<double>::Identity() - d_w * d_w.transpose()) / distance;
  if (J_d_P != nullptr) *J_d_P = J_P;
  if (J_d_plane != nullptr) *J_d_plane << -plane.R_base_from_world * skew(d_w), -J_P;
  return PlaneStatus::kOk;
}

WorldPlane plane_plus(const WorldPlane& plane,
                      const Matrix<double, kPlaneParameterCount, 1>& change) {
  WorldPlane out = plane;
  out.R_base_from_world = plane.R_base_from_world * exp_so3(Vector3<double>(change.head<3>()));
  out.position += change.tail<3>();
  return out;
}

Matrix<double, kPlaneParameterCount, 1> plane_minus(const WorldPlane& to, const WorldPlane& from) {
  Matrix<double, kPlaneParameterCount, 1> out;
  out << log_so3(Matrix3<double>(from.R_base_from_world.transpose() * to.R_base_from_world)),
      to.position - from.position;
  return out;
}

}  // namespace alidade
