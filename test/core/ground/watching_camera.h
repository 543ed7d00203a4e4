#pragma once
// A camera on a mast, whose base does not stand level, and which turns while its rows are exposed.

#include <gtest/gtest.h>

#include "core/ground/world_plane.h"
#include "core/realtime/frame_orientation.h"

namespace alidade::test {

inline constexpr double kDegree = kPi / 180;

inline WorldPlane mast(double height_m = 12) {
  WorldPlane plane;
  plane.R_base_from_world = R_base_from_world_of(0.7, 0.03, -0.02);
  plane.position = {35, -20, height_m};
  Vector4<double> sigma(1e-3, 1e-3, 2e-3, 0.05);
  plane.covariance.diagonal() << sigma.head<3>().cwiseAbs2(),
      Vector3<double>::Constant(sigma[3] * sigma[3]);
  plane.covariance(0, 3) = plane.covariance(3, 0) = 0.4 * sigma[0] * sigma[3];
  plane.covariance(2, 5) = plane.covariance(5, 2) = -0.3 * sigma[2] * sigma[3];
  return plane;
}

inline Calibration watching_calibration(double focal_length_px = 2000) {
  Calibration calibration;
  calibration.camera.focal_length = focal_length_px;
  calibration.camera.width = 1920;
  calibration.camera.height = 1080;
  calibration.camera.distortion.radial = -0.1;
  calibration.line_delay = 25e-6;
  calibration.mechanics.tilt_axis = direction_plus(Vector3<double>(0, 1, 0), {0.004, -0.003});
  calibration.clock_offset = -0.03;
  calibration.covariance(index(Parameter::kFocalLength), index(Parameter::kFocalLength)) = 4;
  calibration.covariance(index(Parameter::kClockOffset), index(Parameter::kClockOffset)) = 1e-8;
  calibration.covariance(index(Parameter::kTiltAxis0), index(Parameter::kTiltAxis0)) = 1e-8;
  return calibration;
}

// pan and tilt in rad at the middle row, rates in rad/s.
inline FrameOrientation watching_frame(const Calibration& calibration, double pan, double tilt,
                                       double pan_rate = 0.4, double tilt_rate = -0.1) {
  FrameMotion<double> motion;
  motion.angle = {pan, tilt};
  motion.rate = {pan_rate, tilt_rate};
  motion.acceleration = {0.5, 0.2};
  motion.reference_row = 540;
  MotionCovariance cov = MotionCovariance::Zero();
  cov.diagonal() << 1e-8, 1e-8, 1e-6, 1e-6, 1e-4, 1e-4;
  FrameOrientation frame;
  EXPECT_TRUE(make_frame_orientation(calibration, 5, OrientationMode::kPt, 0, motion, cov,
                                     telemetry_sensitivity(calibration.mechanics, motion), &frame));
  return frame;
}

// The same camera as the paper has it: no distortion, all rows at once.
inline FrameOrientation global_shutter_frame(double focal_length_px, double pan, double tilt) {
  Calibration calibration = watching_calibration(focal_length_px);
  calibration.camera.distortion.radial = 0;
  calibration.line_delay = 0;
  return watching_frame(calibration, pan, tilt);
}

}  // namespace alidade::test
