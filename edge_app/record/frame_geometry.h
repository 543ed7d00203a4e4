#pragma once
// FrameGeometry and PlainCalibration: the numbers of a FrameOrientation and of a Calibration.
// Together they give any pixel of a frame a direction, and back, with covariance. They cross the
// queue to the output thread by value: Eigen's matrices are not trivially copyable, so matrices are
// stored here as arrays, row by row.
// Units, frames and meaning: frame_orientation.h, calibration.h. Packing allocates nothing.

#include <array>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "core/realtime/frame_orientation.h"

namespace alidade {

struct PlainCalibration {
  double focal_length = 0;
  double aspect = 1;
  double radial_distortion = 0;
  double centre_u = 0;
  double centre_v = 0;
  std::int32_t width = 0;
  std::int32_t height = 0;
  double line_delay = 0;
  std::array<double, 3> pan_axis{0, 0, 1};
  std::array<double, 3> tilt_axis{0, 1, 0};
  double pan_scale = 1;
  double tilt_scale = 1;
  double clock_offset = 0;
  std::optional<double> zoom;
  std::array<double, kParameterCount * kParameterCount> covariance{};
  std::array<double, 4> centre_error{};
};

struct FrameGeometry {
  OrientationMode mode = OrientationMode::kNone;
  PanTilt<double> angle;                  // rad, true angle, not wrapped
  PanTilt<double> rate;                   // rad/s
  PanTilt<double> acceleration;           // rad/s^2
  double zoom_rate = 0;                   // 1/s
  std::optional<double> zoom_rate_sigma;  // 1/s; empty: the lens is taken to be at rest
  std::array<double, 36> motion_covariance{};
  std::array<double, 6 * kParameterCount> motion_sensitivity{};
};
static_assert(std::is_trivially_copyable_v<PlainCalibration> &&
              std::is_trivially_copyable_v<FrameGeometry>);

[[nodiscard]] PlainCalibration pack(const Calibration& calibration);
[[nodiscard]] FrameGeometry pack(const FrameOrientation& frame);

[[nodiscard]] Calibration unpack(const PlainCalibration& calibration);
// Restores what direction() and pixel() need. The other members keep their default values.
[[nodiscard]] FrameOrientation unpack(const FrameGeometry& geometry,
                                      const PlainCalibration& calibration);

}  // namespace alidade
