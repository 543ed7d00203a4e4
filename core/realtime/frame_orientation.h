#pragma once
// FrameOrientation: how the camera looked into the world while one frame was exposed, and so the
// direction of each of its pixels, whichever mode found it.
//
//   R_base_from_camera at row 0 (PTCEE 45), angular velocity (PTCEE 46), and, for any row v,
//   direction = R_base_from_camera(angle + rate t + acceleration t^2 / 2) unproject(u),
//   t = v * line_delay   (PTCEE 26, 27, and beyond)
//
// Angles are TRUE ones (rad), i.e. the measured ones divided by the calibrated scales; frames b (FRD)
// and c (RDF). An orientation is perturbed as R Exp(xi), xi in the camera frame (PTCEE 5). Pixels are
// continuous, the centre of the top-left one is at (0.5, 0.5). Covariances are first-order and
// contain the calibration's own covariance. No allocation; plain values, any number of threads may
// read one.

#include <Eigen/Geometry>
#include <cstdint>

#include "core/model/calibration.h"
#include "core/model/projection_status.h"
#include "core/model/rolling_shutter.h"

namespace alidade {

enum class OrientationMode {
  kNone,  // no orientation: the other fields mean nothing
  kPt,    // from telemetry
  kOe     // from telemetry and landmarks
};

[[nodiscard]] constexpr const char* to_string(OrientationMode mode) {
  switch (mode) {
    case OrientationMode::kNone:
      return "none";
    case OrientationMode::kPt:
      return "PT";
    case OrientationMode::kOe:
      return "OE";
  }
  return "unknown mode";
}

// Of (pan, tilt, pan rate, tilt rate, pan acceleration, tilt acceleration).
using MotionCovariance = Matrix<double, 6, 6>;

struct FrameOrientation {
  double time_s = 0;  // capture of row 0, image clock
  OrientationMode mode = OrientationMode::kNone;
  int landmarks = 0;        // that held the result
  Calibration calibration;  // by which it was found

  // At row 0.
  PanTilt<double> angle;  // rad, true, not wrapped
  PanTilt<double> rate;   // rad/s, true
  // rad/s^2, true, constant during the frame; 0 in PT mode, which has its effect in the covariance
  PanTilt<double> acceleration;
  double zoom_rate = 0;        // 1/s, d log f / dt; the calibration's camera is that of row 0
  std::optional<double> zoom_rate_sigma;  // 1/s; none: the lens is taken as at rest
  MotionCovariance motion_covariance = MotionCovariance::Zero();  // WITHOUT the calibration's part
  Sensitivity<6> motion_sensitivity = Sensitivity<6>::Zero();     // which this tells
  Matrix3<double> R_base_from_camera = r_frd_from_rdf<double>();
  Matrix3<double> orientation_covariance = Matrix3<double>::Zero();  // rad^2, of xi
  Vector3<double> angular_velocity = Vector3<double>::Zero();        // rad/s, camera frame

  [[nodiscard]] FrameMotion<double> motion() const {
    return {angle, rate, 0.0, acceleration, zoom_rate};
  }
  [[nodiscard]] Eigen::Quaterniond quaternion() const {
    return Eigen::Quaterniond(R_base_from_camera);
  }

  // Direction of pixel u in b at its own row's time; cov, if not null, is its covariance (rad^2) in
  // tangent_basis(*d_b) for an exactly known u.
  [[nodiscard]] ProjectionStatus direction(const Vector2<double>& u, Vector3<double>* d_b,
                                           Matrix2<double>* cov = nullptr) const;

  // The pixel that sees a direction, inside the image or not; cov (px^2) for an exactly known d_b.
  [[nodiscard]] ProjectionStatus pixel(const Vector3<double>& d_b, Vector2<double>* u,
                                       Matrix2<double>* cov = nullptr) const;
};

// Of a motion that telemetry tells, looked up when the reference row is exposed.
[[nodiscard]] Sensitivity<6> telemetry_sensitivity(const Mechanics<double>& mechanics,
                                                   const FrameMotion<double>& motion);

// Fills everything from the true motion about any row, at which the calibration's camera holds, its measurement's covariance and its
// sensitivity. False if a result is not finite; *out is then untouched.
[[nodiscard]] bool make_frame_orientation(const Calibration& calibration, double time_s,
                                          OrientationMode mode, int landmarks,
                                          const FrameMotion<double>& motion,
                                          const MotionCovariance& motion_covariance,
                                          const Sensitivity<6>& motion_sensitivity,
                                          FrameOrientation* out);

}  // namespace alidade
