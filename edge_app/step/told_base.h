#pragma once
// ToldBase: the localization thread's result for one frame, for the real-time thread: by how much
// the frame's record is off in the scene map's base; or, if the record has no orientation, where
// the camera looked. Fixed size and trivially copyable: crosses the queue by value.

#include <array>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "core/realtime/oe_mode/base_tie.h"

namespace alidade {

struct ToldBase {
  std::int64_t frame = 0;
  double time_s = 0;                   // s, of the record
  std::array<double, 2> change_rad{};  // (pan, tilt), true angles: as localized minus as answered
  std::array<double, 3> covariance{};  // rad^2, of the localization: pan, pan with tilt, tilt
  bool moved = false;                  // the base or telemetry's zero has moved
  // For a frame without an orientation: its orientation when the middle row was exposed, row by
  // row, and the covariance of R Exp(xi), xi in the camera frame, rad^2. change_rad and covariance
  // are then 0.
  bool is_whole = false;
  std::array<double, 9> R_base_from_camera{};
  std::array<double, 9> R_covariance{};
  double log_f = 0;  // likewise: logarithm of the focal length in px, and its variance
  double log_f_variance = 0;
};
static_assert(std::is_trivially_copyable_v<ToldBase>);

[[nodiscard]] inline std::array<double, 9> pack_matrix(const Matrix3<double>& m) {
  return {m(0, 0), m(0, 1), m(0, 2), m(1, 0), m(1, 1), m(1, 2), m(2, 0), m(2, 1), m(2, 2)};
}
[[nodiscard]] inline Matrix3<double> unpack_matrix(const std::array<double, 9>& m) {
  Matrix3<double> out;
  out << m[0], m[1], m[2], m[3], m[4], m[5], m[6], m[7], m[8];
  return out;
}

// A covariance of (pan, tilt): pan, pan with tilt, tilt.
[[nodiscard]] inline std::array<double, 3> pack_symmetric(const Matrix2<double>& m) {
  return {m(0, 0), m(0, 1), m(1, 1)};
}
[[nodiscard]] inline Matrix2<double> unpack_symmetric(const std::array<double, 3>& m) {
  Matrix2<double> out;
  out << m[0], m[1], m[1], m[2];
  return out;
}

[[nodiscard]] inline BaseMeasurement unpack(const ToldBase& told) {
  BaseMeasurement out;
  out.change = {told.change_rad[0], told.change_rad[1]};
  out.covariance = unpack_symmetric(told.covariance);
  out.moved = told.moved;
  return out;
}

}  // namespace alidade
