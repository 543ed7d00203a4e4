#pragma once
// LensCurve: a lens over its range of focal lengths, with s = log f (px) by the zoom reading, from
// a data sheet or an earlier calibration. x(s) = (delta, kappa, c_u, c_v) is a cubic B-spline.
//   log f = s + delta(s) + eps                        eps: how the lens came to rest this time
//   k = kappa (f / R)^2 exp(2 (hold - 1) eps)   R: half the image's diagonal, px
//   c: optical centre from the image's middle, px
// kappa is the distortion in the corner (core/model/zoom_curve.h). With eps, hold = 1 keeps kappa,
// hold = 0 keeps k. Beyond the ends x is constant. Linear in the control points. The constructor
// allocates.

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/model/camera.h"
#include "core/model/cubic_spline.h"
#include "core/model/rolling_shutter.h"

namespace alidade {

// delta, kappa, c_u, c_v
inline constexpr int kLensQuantityCount = 4;
using LensQuantities = Matrix<double, kLensQuantityCount, 1>;
using CameraColumn = Matrix<double, kCameraParameterCount, 1>;

class LensCurve : public CubicSpline<kLensQuantityCount, LensCurve> {
 public:
  static constexpr double kUnknownHold = 0.5;

  LensCurve() = default;

  // Over log f from first to last, in segments of at most `spacing`. All points are those of
  // `camera`, apart from its f.
  LensCurve(const Camera<double>& camera, double first, double last, double spacing)
      : CubicSpline(even_knots(first, last, spacing)),
        width_(camera.width),
        height_(camera.height),
        aspect_(camera.aspect) {
    const double to_corner = corner_px() / camera.focal_length;
    const LensQuantities x(0, camera.radial_distortion * to_corner * to_corner, camera.centre_u,
                           camera.centre_v);
    for (int i = 0; i < control_points(); ++i) control_point(i) = x;
  }

  // All quantities 0, to be filled in: for stored knots and control points. Two knots or more,
  // increasing.
  LensCurve(int width, int height, double aspect, const std::vector<double>& knots)
      : CubicSpline(knots), width_(width), height_(height), aspect_(aspect) {}

  // A lens that does not zoom; f may differ nevertheless.
  [[nodiscard]] static LensCurve of(const Camera<double>& camera) {
    const double log_f = std::log(camera.focal_length);
    return {camera, log_f - 0.01, log_f + 0.01, 1};
  }

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] double aspect() const { return aspect_; }
  [[nodiscard]] double corner_px() const { return std::hypot(width_, height_) / 2; }
  [[nodiscard]] double& hold() { return hold_; }
  [[nodiscard]] double hold() const { return hold_; }

  // Weights at s, clamped to the curve's range.
  [[nodiscard]] Basis basis_at(double s) const { return basis(std::clamp(s, begin_s(), end_s())); }

  // The camera for given quantities; uses only this lens's shape. J_*: d (f, alpha, k, c_u,
  // c_v) / d x, / d eps, / d hold.
  struct Jacobians {
    Matrix<double, kCameraParameterCount, kLensQuantityCount> J_x;
    CameraColumn J_eps;
    CameraColumn J_hold;
  };
  [[nodiscard]] Camera<double> camera(double s, const LensQuantities& x, double eps, double hold,
                                      Jacobians* jacobians = nullptr) const {
    Camera<double> out;
    out.focal_length = std::exp(s + x[0] + eps);
    out.aspect = aspect_;
    out.width = width_;
    out.height = height_;
    const double k_by_kappa = out.distortion_of_corner() * std::exp(2 * (hold - 1) * eps);
    out.radial_distortion = x[1] * k_by_kappa;
    out.set_centre_offset(x.tail<2>());
    if (jacobians != nullptr) {
      const double k = out.radial_distortion;
      jacobians->J_x << out.focal_length, 0, 0, 0,  //
          0, 0, 0, 0,                               //
          2 * k, k_by_kappa, 0, 0,                  //
          0, 0, 1, 0,                               //
          0, 0, 0, 1;
      jacobians->J_eps << out.focal_length, 0, 2 * hold * k, 0, 0;
      jacobians->J_hold << 0, 0, 2 * eps * k, 0, 0;
    }
    return out;
  }
  [[nodiscard]] Camera<double> camera_at(double s, double eps = 0) const {
    return camera(s, value(basis_at(s)), eps, hold_);
  }

  // The camera of a focal length, whatever its zoom reading. J_camera_log: d (f, alpha, k, c_u,
  // c_v) / d log f.
  [[nodiscard]] Camera<double> camera_of(double log_f, CameraColumn* J_camera_log = nullptr) const {
    // Fixed-point iteration; converges as delta changes slowly.
    double s = log_f;
    for (int step = 0; step < 30; ++step) {
      const double before = s;
      s = log_f - value(basis_at(s))[0];
      if (std::abs(s - before) < 1e-13) break;
    }
    const Basis at = basis_at(s);
    const LensQuantities x = value(at);
    const Camera<double> out = camera(s, x, log_f - s - x[0], hold_);
    if (J_camera_log != nullptr) {
      const bool inside = begin_s() < s && s < end_s();
      const LensQuantities slope = inside ? derivative(at) : LensQuantities(LensQuantities::Zero());
      const LensQuantities by_log = slope / (1 + slope[0]);
      *J_camera_log << out.focal_length, 0,
          2 * out.radial_distortion + by_log[1] * out.distortion_of_corner(), by_log[2], by_log[3];
    }
    return out;
  }

 private:
  [[nodiscard]] static std::vector<double> even_knots(double first, double last, double spacing) {
    const int segments = std::max(1, static_cast<int>(std::ceil((last - first) / spacing)));
    std::vector<double> out;
    for (int i = 0; i <= segments; ++i) out.push_back(first + (last - first) * i / segments);
    return out;
  }

  int width_ = 0;
  int height_ = 0;
  double aspect_ = 1;
  double hold_ = kUnknownHold;
};

}  // namespace alidade
