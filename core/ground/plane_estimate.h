#pragma once
// A world plane as files and answers have it: six values that mean something to a person, with their covariance, and where on Earth
// its frame is, if that is known. No allocation.

#include <Eigen/LU>
#include <array>
#include <optional>

#include "core/ground/local_frame.h"
#include "core/ground/world_plane.h"

namespace alidade {

struct PlaneEstimate {
  WorldPlane plane;
  std::optional<GeodeticPosition> origin;  // x is east and y north of it
};

// heading, pitch, roll of the base (rad, BaseAttitude); place of the camera (m).
inline constexpr std::array<const char*, kPlaneParameterCount> kPlaneValueNames = {
    "heading", "pitch", "roll", "x", "y", "height"};

struct PlaneValues {
  Matrix<double, kPlaneParameterCount, 1> value;
  PlaneCovariance covariance;
};

// The base's forward direction must not point straight up or down (kLeastForward): its heading would mean nothing.
[[nodiscard]] inline PlaneValues plane_values(const WorldPlane& plane) {
  const BaseAttitude attitude = base_attitude(plane);
  PlaneValues out;
  out.value << attitude.heading, attitude.pitch, attitude.roll, plane.position;
  PlaneCovariance J = PlaneCovariance::Identity();
  J.topLeftCorner<3, 3>() = attitude_jacobian(attitude).inverse();
  out.covariance = J * plane.covariance * J.transpose();
  out.covariance = (out.covariance + out.covariance.transpose()).eval() / 2;
  // A heading that is defined has none but rounding.
  if (out.covariance(0, 0) < 1e-20 * out.covariance.topLeftCorner<3, 3>().trace()) {
    out.covariance.row(0).setZero();
    out.covariance.col(0).setZero();
  }
  return out;
}

}  // namespace alidade
