#pragma once
// LensCurve: a lens over its range of focal lengths. s is log f (px) as a data sheet or an earlier
// calibration gives it for the zoom reading. x(s) = (delta, kappa, c_u, c_v) is a cubic B-spline.
//   log f = s + delta(s) + eps                        eps: how the lens came to rest this time
//   kappa: distortion in the corner (core/model/lens/zoom_law.h) at log f = s + delta(s)
//   c: optical centre from the image's middle, px
// Where eps changes f, hold = 1 keeps kappa and hold = 0 keeps the distortion's terms. Beyond the
// ends x is constant. x is linear in the control points. Only constructors allocate.

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/model/cubic_spline.h"
#include "core/model/lens/camera.h"
#include "core/model/lens/zoom_law.h"

namespace alidade {

// x(s), in the order of ZoomQuantity, with delta in the place of log f.
inline constexpr int kLensQuantityCount = kZoomQuantityCount;
using LensQuantities = ZoomQuantities<double>;

class LensCurve : public CubicSpline<kLensQuantityCount, LensCurve> {
 public:
  static constexpr double kUnknownHold = 0.5;  // if nothing is known of hold

  LensCurve() = default;

  // Over s from first to last (last > first), in segments of at most `spacing` (> 0), all log f.
  // Each control point has delta 0 and the camera's kappa and centre.
  LensCurve(const Camera<double>& camera, double first, double last, double spacing)
      : CubicSpline(even_knots(first, last, spacing)),
        width_(camera.width),
        height_(camera.height),
        aspect_(camera.aspect) {
    LensQuantities x = zoom_quantities(camera);
    x[0] = 0;
    for (int i = 0; i < control_points(); ++i) control_point(i) = x;
  }

  // All quantities are 0, to be filled in: for stored knots and control points. knots: log f, two
  // or more, increasing.
  LensCurve(int width, int height, double aspect, const std::vector<double>& knots)
      : CubicSpline(knots), width_(width), height_(height), aspect_(aspect) {}

  // A lens that does not zoom; eps may still change f.
  [[nodiscard]] static LensCurve of(const Camera<double>& camera) {
    const double log_f = std::log(camera.focal_length);
    return {camera, log_f - 0.01, log_f + 0.01, 1};
  }

  // px, but for the aspect.
  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  [[nodiscard]] double aspect() const { return aspect_; }
  [[nodiscard]] double corner_px() const { return std::hypot(width_, height_) / 2; }
  [[nodiscard]] double& hold() { return hold_; }
  [[nodiscard]] double hold() const { return hold_; }

  // Weights at s, clamped to the curve's range.
  [[nodiscard]] Basis basis_at(double s) const { return basis(std::clamp(s, begin_s(), end_s())); }

  // The camera for given quantities; uses only image size and aspect of this object. J_*: d camera
  // / d x, / d eps, / d hold.
  struct Jacobians {
    Matrix<double, kCameraParameterCount, kLensQuantityCount> J_x;
    CameraColumn<double> J_eps;
    CameraColumn<double> J_hold;
  };
  [[nodiscard]] Camera<double> camera(double s, const LensQuantities& x, double eps, double hold,
                                      Jacobians* jacobians = nullptr) const {
    Camera<double> out;
    out.focal_length = std::exp(s + x[0] + eps);
    out.aspect = aspect_;
    out.width = width_;
    out.height = height_;
    out.set_centre_offset(x.tail<2>());
    CornerDistortion<double> unit = corner_unit(out);
    // What hold < 1 takes back of the zoom by eps.
    const CornerDistortion<double> kept = distortion_by_zoom((hold - 1) * eps);
    for (int i = 0; i < kDistortionCount; ++i) {
      unit[i] *= kept[i];
      out.distortion[i] = x[index(ZoomQuantity::kCornerDistortion) + i] * unit[i];
    }
    if (jacobians == nullptr) return out;
    const CameraColumn<double> along = by_zoom(out);
    jacobians->J_x.setZero();
    jacobians->J_x.col(0) = along;
    for (int i = 0; i < kDistortionCount; ++i) {
      jacobians->J_x(camera_column::kDistortion + i, index(ZoomQuantity::kCornerDistortion) + i) =
          unit[i];
    }
    jacobians->J_x.bottomRightCorner<2, 2>().setIdentity();
    jacobians->J_eps = hold * along;
    jacobians->J_eps[camera_column::kFocalLength] = out.focal_length;
    jacobians->J_hold = eps * along;
    jacobians->J_hold[camera_column::kFocalLength] = 0;
    return out;
  }
  [[nodiscard]] Camera<double> camera_at(double s, double eps = 0) const {
    return camera(s, value(basis_at(s)), eps, hold_);
  }

  // The camera with this focal length, if the zoom reading is not known: eps is 0. log_f: f in px.
  // J_camera_log: d camera / d log f.
  [[nodiscard]] Camera<double> camera_of(double log_f,
                                         CameraColumn<double>* J_camera_log = nullptr) const {
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
      const CornerDistortion<double> unit = corner_unit(out);
      *J_camera_log = by_zoom(out);
      for (int i = 0; i < kDistortionCount; ++i) {
        (*J_camera_log)[camera_column::kDistortion + i] +=
            by_log[index(ZoomQuantity::kCornerDistortion) + i] * unit[i];
      }
      J_camera_log->tail<2>() = by_log.tail<2>();
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
