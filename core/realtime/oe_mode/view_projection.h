#pragma once
// ViewProjection: fast projection of many directions into one frame, with rolling shutter.
// Same model as rolling_shutter.h. R_camera_from_base is prepared once per frame, as a quadratic in
// the row through its values at the first, middle and last row (error: docs/derivations.md). The
// row is found by a secant from a first guess. A zooming lens (FrameMotion::zoom_rate) scales the
// direction's third component by exp(-zoom_rate t).
// Pure; no allocation. Directions outside the image are projected too, as far as the camera model
// goes and, with a rolling shutter, up to half an image height above and below.

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "core/model/calibration.h"
#include "core/model/lens/camera.h"
#include "core/model/lens/zoom_law.h"
#include "core/model/rolling_shutter.h"

namespace alidade {

// A direction in the frame, and the derivatives of its pixel, including the change of the row's
// time.
struct SeenDirection {
  Vector2<double> u;         // px
  double time_s;             // s, of its row after the reference row
  Matrix2<double> J_angle;   // px/rad, d u / d (pan, tilt) at that time
  Matrix<double, 2, 3> J_d;  // px/rad, d u / d direction (tangential changes)
};

class ViewProjection {
 public:
  // calibration: image height > 0.
  ViewProjection(const Calibration& calibration, const FrameMotion<double>& motion)
      : camera_(calibration.camera),
        line_delay_(calibration.line_delay),
        motion_(motion),
        middle_row_(0.5 * calibration.camera.height),
        zoom_to_last_row_(motion.zoom_rate * calibration.line_delay * middle_row_) {
    const auto R_at = [&](double row, Matrix<double, 3, 2>* J) -> Matrix3<double> {
      return R_base_from_camera(calibration.mechanics, angle_at_row(motion, line_delay_, row), J,
                                J != nullptr ? &J_xi_axes_ : nullptr)
          .transpose();
    };
    const Matrix3<double> first = R_at(0, nullptr);
    const Matrix3<double> last = R_at(calibration.camera.height, nullptr);
    R_[0] = R_at(middle_row_, &J_xi_angle_);
    R_[1] = 0.5 * (last - first);
    R_[2] = 0.5 * (last + first) - R_[0];
    if (motion.zoom_rate == 0) return;
    camera_ = camera_at_row(calibration.camera, motion, line_delay_, middle_row_);
    to_middle_row_ = camera_.focal_length / calibration.camera.focal_length;
  }

  // False if the camera has no pixel for it, its row is too far outside the image, or the row is
  // not unique or does not converge; the output is then not to be used, here and below.
  [[nodiscard]] bool project(const Vector3<double>& d, Vector2<double>* u) const {
    Path path;
    return find(d, &path, u);
  }

  // To about a pixel, for choosing.
  [[nodiscard]] bool project_roughly(const Vector3<double>& d, Vector2<double>* u) const {
    const Vector3<double> middle = R_[0] * d;
    if (alidade::project(camera_, middle, u) != ProjectionStatus::kOk) return false;
    if (line_delay_ == 0) return true;
    const double s = std::clamp(parameter(u->y()), -1.5, 1.5);
    Vector3<double> d_c = middle + s * (R_[1] * d + s * (R_[2] * d));
    if (zoom_to_last_row_ != 0) d_c.z() *= depth(s);
    return alidade::project(camera_, d_c, u) == ProjectionStatus::kOk;
  }

  // J_parameters: d u / d Parameter for this motion about its reference row.
  [[nodiscard]] bool project(const Vector3<double>& d, SeenDirection* out,
                             Sensitivity<2>* J_parameters = nullptr) const {
    Path path;
    if (!find(d, &path, &out->u)) return false;
    const double s = parameter(out->u.y());
    const Vector3<double> d_c = path.at(s);  // without the zoom
    Vector3<double> zoomed_d_c = d_c;
    Vector3<double> slope = path.slope(s);
    if (zoom_to_last_row_ != 0) zoom(s, &zoomed_d_c, &slope);
    Vector2<double> u;
    Matrix<double, 2, 3> J_u_dc;
    Matrix<double, 2, kCameraParameterCount> J_u_camera;
    if (alidade::project(camera_, zoomed_d_c, &u, &J_u_dc,
                         J_parameters != nullptr ? &J_u_camera : nullptr) !=
        ProjectionStatus::kOk) {
      return false;
    }
    out->time_s = time_of_row(motion_, line_delay_, out->u.y());
    const Vector2<double> J_u_row = J_u_dc * slope / middle_row_;
    if (zoom_to_last_row_ != 0) J_u_dc.col(2) *= depth(s);
    // The row follows the pixel: see rolling_shutter_project().
    Matrix2<double> J_u_fixed = Matrix2<double>::Identity();
    J_u_fixed.col(1) += J_u_row / (1 - J_u_row.y());
    const Matrix<double, 2, 3> J_u = J_u_fixed * J_u_dc;
    // d_c (+) turns by d_c x xi
    out->J_angle.col(0) = J_u * d_c.cross(J_xi_angle_.col(0));
    out->J_angle.col(1) = J_u * d_c.cross(J_xi_angle_.col(1));
    out->J_d = J_u * (R_[0] + s * (R_[1] + s * R_[2]));
    if (J_parameters == nullptr) return true;
    J_parameters->setZero();
    const Vector2<double> by_zoom = alidade::by_zoom(camera_, J_u_camera);
    refer_to_unzoomed(to_middle_row_, &J_u_camera);
    J_parameters->leftCols<kCameraParameterCount>() = J_u_fixed * J_u_camera;
    const PanTilt<double> rate = rate_at_row(motion_, line_delay_, out->u.y());
    J_parameters->col(index(Parameter::kLineDelay)) =
        (out->u.y() - motion_.reference_row) * (out->J_angle * rate.vector());
    if (motion_.zoom_rate != 0) {
      J_parameters->col(index(Parameter::kLineDelay)) +=
          (out->u.y() - motion_.reference_row) * motion_.zoom_rate * (J_u_fixed * by_zoom);
    }
    J_parameters->middleCols<4>(index(Parameter::kPanAxis0)) = J_u * skew(d_c) * J_xi_axes_;
    return true;
  }

  // Optical axis at the middle row, in b.
  [[nodiscard]] Vector3<double> optical_axis() const { return R_[0].row(2).transpose(); }

 private:
  // The direction in camera coordinates, as a quadratic in the row.
  struct Path {
    Vector3<double> c0, c1, c2;
    [[nodiscard]] Vector3<double> at(double s) const { return c0 + s * (c1 + s * c2); }
    [[nodiscard]] Vector3<double> slope(double s) const { return c1 + 2 * s * c2; }
  };

  [[nodiscard]] double parameter(double row) const { return (row - middle_row_) / middle_row_; }
  [[nodiscard]] double depth(double s) const { return std::exp(-zoom_to_last_row_ * s); }
  // Applies a row's zoom to a direction in camera coordinates and to its derivative by s.
  void zoom(double s, Vector3<double>* d_c, Vector3<double>* slope) const {
    const double factor = depth(s);
    slope->z() = factor * (slope->z() - zoom_to_last_row_ * d_c->z());
    d_c->z() *= factor;
  }

  [[nodiscard]] bool find(const Vector3<double>& d, Path* path, Vector2<double>* u) const {
    constexpr double kTolerance = 1e-4;  // px; the pixel's error is this times its slope
    constexpr int kMaxSteps = 8;
    *path = {R_[0] * d, R_[1] * d, R_[2] * d};
    if (alidade::project(camera_, path->c0, u) != ProjectionStatus::kOk) return false;
    if (line_delay_ == 0) return true;
    double row = middle_row_;
    double v = u->y();
    // A difference quotient over a step of mere rounding would be meaningless, too.
    if (std::abs(v - row) < kTolerance) return true;
    double slope = 0;
    for (int step = 0; step < kMaxSteps; ++step) {
      // Far outside the image the quadratic would be extrapolated, and it is not needed.
      const double next = row + (v - row) / (1 - slope);
      if (!(next > -0.5 * camera_.height && next < 1.5 * camera_.height)) return false;
      Vector3<double> d_c = path->at(parameter(next));
      if (zoom_to_last_row_ != 0) d_c.z() *= depth(parameter(next));
      if (alidade::project(camera_, d_c, u) != ProjectionStatus::kOk) return false;
      slope = (u->y() - v) / (next - row);
      if (!(slope < 1)) return false;
      row = next;
      v = u->y();
      if (std::abs(v - row) < kTolerance) return true;
    }
    return false;
  }

  Camera<double> camera_;     // at the middle row
  double to_middle_row_ = 1;  // its focal length divided by that at the reference row
  double line_delay_;
  FrameMotion<double> motion_;
  double middle_row_;
  double zoom_to_last_row_;  // change of log f from the middle row to the last
  Matrix3<double> R_[3];     // camera from base: R_[0] + s R_[1] + s^2 R_[2], s from -1 to 1
  Matrix<double, 3, 2> J_xi_angle_;
  Matrix<double, 3, 4> J_xi_axes_;
};

}  // namespace alidade
