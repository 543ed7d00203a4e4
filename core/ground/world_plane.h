#pragma once
// WorldPlane: the ground, Z = 0 of a local metric frame w (Z up; X east and Y north, or the
// user's), and the camera above it. Domain: p_z > 0. Outputs are written with kOk only. No
// allocation.
//   X = p + s R_world_from_base d_b,   s = -p_z / (R_world_from_base d_b)_z     direction to plane
//   d_b = R_base_from_world (P - p) / |P - p|                                   point to direction
// Unknowns in this order: xi (rad) of R_base_from_world Exp(xi), xi in w; p (m), the optical centre
// in w. xi_x and xi_y tilt the base against gravity. xi_z changes the heading: it turns the base
// about the vertical, clockwise from above as a compass counts.

#include "core/model/linear_algebra.h"

namespace alidade {

inline constexpr int kPlaneParameterCount = 6;
using PlaneCovariance = Matrix<double, kPlaneParameterCount, kPlaneParameterCount>;

enum class PlaneStatus {
  kOk,
  kAboveHorizon,  // the direction does not meet the plane
  // It meets the plane so far away that the place's sigma exceeds PlaneLimits.
  kTooFar,
  kCameraOnPlane,  // the camera is not above the plane
  kNoDirection,    // the pixel has no direction, or the point no pixel
  kNotFinite
};

[[nodiscard]] const char* to_string(PlaneStatus status);

// If no data tie the camera to the ground, x, y and heading are free. Then the camera defines w:
// the origin is below the camera, Y is below the base's forward direction (heading 0). A definition
// has no error: in the covariance rows p_x and p_y are zero, and xi_z only has the part that keeps
// the heading 0 while the base tilts.
struct WorldPlane {
  Matrix3<double> R_base_from_world = Matrix3<double>::Identity();
  Vector3<double> position = Vector3<double>::Zero();    // p, m, in w
  PlaneCovariance covariance = PlaneCovariance::Zero();  // of (xi, p); rad, m

  [[nodiscard]] Matrix3<double> R_world_from_base() const { return R_base_from_world.transpose(); }
  // Unit length, in base.
  [[nodiscard]] Vector3<double> up_b() const { return R_base_from_world.col(2); }
  // m, of the camera above the plane.
  [[nodiscard]] double height() const { return position.z(); }
};

// rad; heading of the base's forward direction, clockwise from Y. 0 if the base points straight up
// or down (kLeastForward), where the heading is undefined.
[[nodiscard]] double heading(const WorldPlane& plane);
inline constexpr double kLeastForward = 1e-3;  // sine of the angle between forward and the vertical

// d heading / d xi; 0 if the heading is undefined.
[[nodiscard]] Vector3<double> heading_jacobian(const WorldPlane& plane);

// Attitude of the base, as of an aircraft, rad: pitch > 0 lifts the base's forward direction, roll
// > 0 lowers its right side.
[[nodiscard]] Matrix3<double> R_base_from_world_of(double heading, double pitch, double roll);
struct BaseAttitude {
  double heading = 0;
  double pitch = 0;
  double roll = 0;
};
[[nodiscard]] BaseAttitude base_attitude(const WorldPlane& plane);

// d xi / d (heading, pitch, roll). Invertible unless forward points straight up or down.
[[nodiscard]] Matrix3<double> attitude_jacobian(const BaseAttitude& attitude);

// A place's distance grows without bound towards the horizon, and its sigma grows faster. If sigma
// exceeds a share of the distance, a first-order sigma means nothing: the status is kTooFar.
struct PlaneLimits {
  double most_sigma_share = 0.2;  // largest sigma of a place over its distance from the camera

  // False unless the share is above 0 and below 1. *error then says so in one line; error must not
  // be null.
  [[nodiscard]] bool validate(const char** error) const;
};

// A place on the plane seen from the camera.
struct PlanePoint {
  Vector2<double> position;    // m, X and Y in w
  Matrix2<double> covariance;  // m^2
  double distance = 0;         // m, from the optical centre
};

// X: m, in w. J_X_d: by any change of d_b, also of its length. J_X_plane: by (xi, p). The Jacobians
// may be null. Here kTooFar is given only if numbers overflow.
[[nodiscard]] PlaneStatus plane_point(const WorldPlane& plane, const Vector3<double>& d_b,
                                      Vector2<double>* X, Matrix<double, 2, 3>* J_X_d = nullptr,
                                      Matrix<double, 2, kPlaneParameterCount>* J_X_plane = nullptr);

// The same with uncertainty. cov_d: covariance of the direction (rad^2, in tangent_basis(d_b)),
// taken as independent of the plane's. d_b: unit length.
[[nodiscard]] PlaneStatus plane_point(const WorldPlane& plane, const Vector3<double>& d_b,
                                      const Matrix2<double>& cov_d, const PlaneLimits& limits,
                                      PlanePoint* out);

// P_w: m, any point, also off the plane. d_b: unit length. kNoDirection: P_w is the optical centre.
// kNotFinite: it is not finite.
[[nodiscard]] PlaneStatus direction_of(
    const WorldPlane& plane, const Vector3<double>& P_w, Vector3<double>* d_b,
    Matrix3<double>* J_d_P = nullptr, Matrix<double, 3, kPlaneParameterCount>* J_d_plane = nullptr);

// The plane after a change of (xi, p); its covariance stays.
[[nodiscard]] WorldPlane plane_plus(const WorldPlane& plane,
                                    const Matrix<double, kPlaneParameterCount, 1>& change);

// The change that leads from `from` to `to`.
[[nodiscard]] Matrix<double, kPlaneParameterCount, 1> plane_minus(const WorldPlane& to,
                                                                  const WorldPlane& from);

}  // namespace alidade
