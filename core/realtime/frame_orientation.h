#pragma once
// FrameOrientation: the camera's orientation while one frame was exposed, from whichever mode found
// it: R_base_from_camera at row 0 (PTCEE 45), angular velocity (PTCEE 46), and for any row v
//   direction = R_base_from_camera(angle + rate t + acceleration t^2 / 2) unproject(u),
//   t = v * line_delay   (PTCEE 26, 27, and beyond)
// Angles are TRUE (rad): measured ones without known errors, divided by the scales. Frames: base b
// (FRD), camera c (RDF). An orientation is perturbed as R Exp(xi) (PTCEE 5), xi in the camera
// frame. xi is the error of directions in the image's middle: an error of the optical centre by
// c px counts as a turn by c / f, with its correlation to the errors of the axes.
// Pixels are continuous; the centre of the top-left one is (0.5, 0.5). Covariances are first-order
// and contain the calibration's. No allocation; plain values; any number of threads may read one.

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>

#include "core/model/calibration.h"
#include "core/model/projection_status.h"
#include "core/model/rolling_shutter.h"

namespace alidade {

enum class OrientationMode {
  kNone,  // no orientation; the other fields are invalid
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

// Order: pan, tilt, pan rate, tilt rate, pan acceleration, tilt acceleration; rad, rad/s, rad/s^2.
using MotionCovariance = Matrix<double, 6, 6>;

struct FrameOrientation {
  double time_s = 0;  // s, image clock; capture of row 0
  OrientationMode mode = OrientationMode::kNone;
  int landmarks = 0;        // number used (inliers)
  Calibration calibration;  // used to find the orientation

  // At row 0.
  PanTilt<double> angle;  // rad, true, not wrapped
  PanTilt<double> rate;   // rad/s, true
  // rad/s^2, true, constant during the frame. 0 in PT mode: there the covariance contains the
  // effect of an acceleration.
  PanTilt<double> acceleration;
  double zoom_rate = 0;  // 1/s, d log f / dt; calibration.camera holds at row 0
  // 1/s; empty: the frame does not show zoom_rate, and the lens is taken to be at rest.
  std::optional<double> zoom_rate_sigma;
  MotionCovariance motion_covariance = MotionCovariance::Zero();  // WITHOUT the calibration's part
  Sensitivity<6> motion_sensitivity = Sensitivity<6>::Zero();     // gives the calibration's part
  Matrix3<double> R_base_from_camera = r_frd_from_rdf<double>();
  Matrix3<double> orientation_covariance = Matrix3<double>::Zero();  // rad^2, of xi
  Vector3<double> angular_velocity = Vector3<double>::Zero();        // rad/s, camera frame

  [[nodiscard]] FrameMotion<double> motion() const {
    return {angle, rate, 0.0, acceleration, zoom_rate};
  }
  [[nodiscard]] Eigen::Quaterniond quaternion() const {
    return Eigen::Quaterniond(R_base_from_camera);
  }

  // Direction of pixel u in b at the time of its own row. cov, if not null, is its covariance
  // (rad^2) in tangent_basis(*d_b) for an exact u. Outputs are written with kOk only. kNotFinite
  // with mode kNone. Both hold for pixel(), too.
  [[nodiscard]] ProjectionStatus direction(const Vector2<double>& u, Vector3<double>* d_b,
                                           Matrix2<double>* cov = nullptr) const;

  // The pixel that sees a direction, inside the image or not. cov (px^2) is for an exact d_b.
  [[nodiscard]] ProjectionStatus pixel(const Vector3<double>& d_b, Vector2<double>* u,
                                       Matrix2<double>* cov = nullptr) const;
};

// Sensitivity of a motion from telemetry, looked up when the reference row is exposed.
[[nodiscard]] Sensitivity<6> telemetry_sensitivity(const Mechanics<double>& mechanics,
                                                   const FrameMotion<double>& motion);

// Fills *out from the true motion, its measurement covariance and its sensitivity. The motion's
// reference row may be any; the calibration's camera must hold there. False if a result is not
// finite; *out is then unchanged.
[[nodiscard]] bool make_frame_orientation(const Calibration& calibration, double time_s,
                                          OrientationMode mode, int landmarks,
                                          const FrameMotion<double>& motion,
                                          const MotionCovariance& motion_covariance,
                                          const Sensitivity<6>& motion_sensitivity,
                                          FrameOrientation* out);

}  // namespace alidade
