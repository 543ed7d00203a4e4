#include "edge_app/record/frame_geometry.h"

namespace alidade {
namespace {

template <int rows, int columns>
using RowMajor = Eigen::Matrix<double, rows, columns, Eigen::RowMajor>;

template <int rows, int columns, std::size_t size>
void store(const Matrix<double, rows, columns>& matrix, std::array<double, size>* out) {
  static_assert(static_cast<std::size_t>(rows * columns) == size);
  Eigen::Map<RowMajor<rows, columns>>(out->data()) = matrix;
}

template <int rows, int columns, std::size_t size>
Matrix<double, rows, columns> load(const std::array<double, size>& from) {
  static_assert(static_cast<std::size_t>(rows * columns) == size);
  return Eigen::Map<const RowMajor<rows, columns>>(from.data());
}

}  // namespace

PlainCalibration pack(const Calibration& calibration) {
  PlainCalibration out;
  out.focal_length = calibration.camera.focal_length;
  out.aspect = calibration.camera.aspect;
  out.radial_distortion = calibration.camera.distortion.only_term();
  out.centre_u = calibration.camera.centre_u;
  out.centre_v = calibration.camera.centre_v;
  out.width = calibration.camera.width;
  out.height = calibration.camera.height;
  out.line_delay = calibration.line_delay;
  for (int i = 0; i < 3; ++i) {
    out.pan_axis[static_cast<std::size_t>(i)] = calibration.mechanics.pan_axis[i];
    out.tilt_axis[static_cast<std::size_t>(i)] = calibration.mechanics.tilt_axis[i];
  }
  out.pan_scale = calibration.mechanics.pan_scale;
  out.tilt_scale = calibration.mechanics.tilt_scale;
  out.clock_offset = calibration.clock_offset;
  out.zoom = calibration.zoom;
  store(calibration.covariance, &out.covariance);
  store(calibration.centre_error, &out.centre_error);
  return out;
}

FrameGeometry pack(const FrameOrientation& frame) {
  FrameGeometry out;
  out.mode = frame.mode;
  out.angle = frame.angle;
  out.rate = frame.rate;
  out.acceleration = frame.acceleration;
  out.zoom_rate = frame.zoom_rate;
  out.zoom_rate_sigma = frame.zoom_rate_sigma;
  store(frame.motion_covariance, &out.motion_covariance);
  store(frame.motion_sensitivity, &out.motion_sensitivity);
  return out;
}

Calibration unpack(const PlainCalibration& calibration) {
  Calibration out;
  out.camera.focal_length = calibration.focal_length;
  out.camera.aspect = calibration.aspect;
  out.camera.distortion.only_term() = calibration.radial_distortion;
  out.camera.centre_u = calibration.centre_u;
  out.camera.centre_v = calibration.centre_v;
  out.camera.width = calibration.width;
  out.camera.height = calibration.height;
  out.line_delay = calibration.line_delay;
  out.mechanics.pan_axis = Vector3<double>(calibration.pan_axis.data());
  out.mechanics.tilt_axis = Vector3<double>(calibration.tilt_axis.data());
  out.mechanics.pan_scale = calibration.pan_scale;
  out.mechanics.tilt_scale = calibration.tilt_scale;
  out.clock_offset = calibration.clock_offset;
  out.zoom = calibration.zoom;
  out.covariance = load<kParameterCount, kParameterCount>(calibration.covariance);
  out.centre_error = load<2, 2>(calibration.centre_error);
  return out;
}

FrameOrientation unpack(const FrameGeometry& geometry, const PlainCalibration& calibration) {
  FrameOrientation out;
  out.mode = geometry.mode;
  out.calibration = unpack(calibration);
  out.angle = geometry.angle;
  out.rate = geometry.rate;
  out.acceleration = geometry.acceleration;
  out.zoom_rate = geometry.zoom_rate;
  out.zoom_rate_sigma = geometry.zoom_rate_sigma;
  out.motion_covariance = load<6, 6>(geometry.motion_covariance);
  out.motion_sensitivity = load<6, kParameterCount>(geometry.motion_sensitivity);
  return out;
}

}  // namespace alidade
