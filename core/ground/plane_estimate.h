#pragma once
// A world plane as files and answers state it: six values with their covariance, and the place of
// its frame w on Earth if known. No allocation.

#include <Eigen/LU>
#include <array>
#include <optional>

#include "core/ground/local_frame.h"
#include "core/ground/world_plane.h"

namespace alidade {

struct PlaneEstimate {
  WorldPlane plane;
  std::optional<GeodeticPosition> origin;  // of w; if given, x is east and y is north
};

// heading, pitch, roll of the base (rad, BaseAttitude); x, y, height of the camera (m).
inline constexpr std::array<const char*, kPlaneParameterCount> kPlaneValueNames = {
    "heading", "pitch", "roll", "x", "y", "height"};

struct PlaneValues {
  Matrix<double, kPlaneParameterCount, 1> value;  // in the order of kPlaneValueNames
  PlaneCovariance covariance;                     // of value
};

// The base's forward direction must not point straight up or down (kLeastForward): there heading is
// undefined.
[[nodiscard]] inline PlaneValues plane_values(const WorldPlane& plane) {
  const BaseAttitude attitude = base_attitude(plane);
  PlaneValues out;
  out.value << attitude.heading, attitude.pitch, attitude.roll, plane.position;
  PlaneCovariance J = PlaneCovariance::Identity();
  J.topLeftCorner<3, 3>() = attitude_jacobian(attitude).inverse();
  out.covariance = J * plane.covariance * J.transpose();
  out.covariance = (out.covariance + out.covariance.transpose()).eval() / 2;
  // If the base itself defines heading 0, its variance is only rounding.
  if (out.covariance(0, 0) < 1e-20 * out.covariance.topLeftCorner<3, 3>().trace()) {
    out.covariance.row(0).setZero();
    out.covariance.col(0).setZero();
  }
  return out;
}

}  // namespace alidade
