#pragma once
// WorldPlane: the ground, Z = 0 of a local metric frame w (Z up; X east and Y north, or the user's), and where the camera is over it.
//   X = p + s R_world_from_base d_b,   s = -p_z / (R_world_from_base d_b)_z      what a direction meets on the plane
//   d_b = R_base_from_world (P - p) / |P - p|                                    the direction of a point, on the plane or above it
// Unknowns, in this order: xi (rad) of R_base_from_world Exp(xi), xi in w, and p (m), the optical centre in w. xi_x and xi_y tilt the
// base against gravity; xi_z turns it about the vertical, clockwise from above as a compass counts: the heading.
// Three of the six are free where only the camera's own view counts: x, y, heading. Then w is defined by the camera: origin below
// it, Y below the base's forward direction (heading 0), and what is defined has no error: zero rows of p_x, p_y, and xi_z has the
// part only that keeps the heading 0 while the base tilts.
// A direction's range along the ground grows without bound towards the horizon, and its sigma faster: beyond a share of the distance
// first order says nothing, and the status does. Domain: p_z > 0. Outputs are written with kOk only. No allocation.

#include "core/model/linear_algebra.h"

namespace alidade {

inline constexpr int kPlaneParameterCount = 6;
using PlaneCovariance = Matrix<double, kPlaneParameterCount, kPlaneParameterCount>;

enum class PlaneStatus {
  kOk,
  kAboveHorizon,  // the direction never meets the plane
  kTooFar,  // it meets it so far away that the place is not known to the stated share of its distance
  kCameraOnPlane,  // the camera is not above the plane
  kNoDirection,    // the pixel has no direction, or the point no pixel
  kNotFinite
};

[[nodiscard]] const char* to_string(PlaneStatus status);

struct WorldPlane {
  Matrix3<double> R_base_from_world = Matrix3<double>::Identity();
  Vector3<double> position = Vector3<double>::Zero();    // p, m, in w
  PlaneCovariance covariance = PlaneCovariance::Zero();  // of (xi, p); rad, m

  [[nodiscard]] Matrix3<double> R_world_from_base() const { return R_base_from_world.transpose(); }
  [[nodiscard]] Vector3<double> up_b() const { return R_base_from_world.col(2); }
  [[nodiscard]] double height() const { return position.z(); }
};

// rad: where the base's forward direction points, clockwise from Y. Undefined where it points straight up or down (see
// kLeastForward): 0 then.
[[nodiscard]] double heading(const WorldPlane& plane);
inline constexpr double kLeastForward = 1e-3;  // sine of the angle between forward and the vertical

// d heading / d xi.
[[nodiscard]] Vector3<double> heading_jacobian(const WorldPlane& plane);

// How the base stands, as of an aircraft, rad: pitch > 0 lifts its forward direction, roll > 0 lowers its right side.
[[nodiscard]] Matrix3<double> R_base_from_world_of(double heading, double pitch, double roll);
struct BaseAttitude {
  double heading = 0;
  double pitch = 0;
  double roll = 0;
};
[[nodiscard]] BaseAttitude base_attitude(const WorldPlane& plane);

// d xi / d (heading, pitch, roll): invertible unless forward points straight up or down.
[[nodiscard]] Matrix3<double> attitude_jacobian(const BaseAttitude& attitude);

struct PlaneLimits {
  double most_sigma_share = 0.2;  // largest sigma of a place over its distance from the camera

  [[nodiscard]] bool validate(const char** error) const;
};

// A place on the plane, seen from the camera.
struct PlanePoint {
  Vector2<double> position;    // m, X and Y in w
  Matrix2<double> covariance;  // m^2
  double distance = 0;         // m, from the camera
};

// J_X_d for any change of d_b, also one of its length; J_X_plane by (xi, p).
[[nodiscard]] PlaneStatus plane_point(const WorldPlane& plane, const Vector3<double>& d_b,
                                      Vector2<double>* X, Matrix<double, 2, 3>* J_X_d = nullptr,
                                      Matrix<double, 2, kPlaneParameterCount>* J_X_plane = nullptr);

// With the covariance of the direction (rad^2, in its tangent_basis) and that of the plane, independent of it.
[[nodiscard]] PlaneStatus plane_point(const WorldPlane& plane, const Vector3<double>& d_b,
                                      const Matrix2<double>& cov_d, const PlaneLimits& limits,
                                      PlanePoint* out);

// P_w: any point other than the camera's own, not only of the plane.
[[nodiscard]] PlaneStatus direction_of(
    const WorldPlane& plane, const Vector3<double>& P_w, Vector3<double>* d_b,
    Matrix3<double>* J_d_P = nullptr, Matrix<double, 3, kPlaneParameterCount>* J_d_plane = nullptr);

// The plane as it is after a change of (xi, p); the covariance stays.
[[nodiscard]] WorldPlane plane_plus(const WorldPlane& plane,
                                    const Matrix<double, kPlaneParameterCount, 1>& change);

// The change that leads from one to the other.
[[nodiscard]] Matrix<double, kPlaneParameterCount, 1> plane_minus(const WorldPlane& to,
                                                                  const WorldPlane& from);

}  // namespace alidade
