#pragma once
// The base camera: perspective with distortion (PTCEE 28, 29), RDF frame.
//   x = (d_1, d_2) / d_3,   x_d = distortion(x)
//   u = f x_d1 + w/2 + c_u,      v = alpha f x_d2 + h/2 + c_v
// Pixels are continuous; the centre of the top-left pixel is (0.5, 0.5). Pixels outside the image
// have directions too. Beyond the distortion's limit (distortion.h) a direction has no pixel and a
// pixel no direction.
// Domain: f > 0, alpha > 0. Outputs are written with kOk only. No allocation.

#include <cmath>

#include "core/model/lens/distortion.h"
#include "core/model/linear_algebra.h"
#include "core/model/projection_status.h"

namespace alidade {

template <class S>
struct Camera {
  S focal_length = S(1);     // px; f, of the horizontal direction
  S aspect = S(1);           // alpha = f_v / f_u
  Distortion<S> distortion;  // k
  int width = 0;             // px
  int height = 0;            // px
  S centre_u = S(0);         // px; c, optical centre minus the image's middle
  S centre_v = S(0);

  template <class T>
  [[nodiscard]] Camera<T> cast() const {
    return {T(focal_length), T(aspect),  distortion.template cast<T>(), width, height,
            T(centre_u),     T(centre_v)};
  }

  [[nodiscard]] Vector2<S> centre_offset() const { return {centre_u, centre_v}; }
  void set_centre_offset(const Vector2<S>& c) {
    centre_u = c.x();
    centre_v = c.y();
  }
  // px, in the image
  [[nodiscard]] Vector2<S> optical_centre() const {
    return {S(width) / S(2) + centre_u, S(height) / S(2) + centre_v};
  }
};

// The columns of every Jacobian by a camera's parameters. Parameter (calibration.h) begins with
// them.
namespace camera_column {
inline constexpr int kFocalLength = 0;
inline constexpr int kAspect = 1;
inline constexpr int kDistortion = 2;  // and its other terms
inline constexpr int kCentreU = kDistortion + kDistortionCount;
inline constexpr int kCentreV = kCentreU + 1;
}  // namespace camera_column
inline constexpr int kCameraParameterCount = camera_column::kCentreV + 1;

// d_c need not have unit length. J_u_camera: columns of camera_column.
template <class S>
[[nodiscard]] ProjectionStatus project(
    const Camera<S>& camera, const NonDeduced<Vector3<S>>& d_c, NonDeduced<Vector2<S>>* u,
    NonDeduced<Matrix<S, 2, 3>>* J_u_d = nullptr,
    NonDeduced<Matrix<S, 2, kCameraParameterCount>>* J_u_camera = nullptr) {
  if (!all_finite(d_c)) return ProjectionStatus::kNotFinite;
  if (d_c.z() <= S(0)) return ProjectionStatus::kBehindCamera;
  const S& f = camera.focal_length;
  const S& aspect = camera.aspect;
  const Vector2<S> x = d_c.template head<2>() / d_c.z();
  Vector2<S> x_d;
  Matrix2<S> J_u_x;
  if (!camera.distortion.distort(x, &x_d, J_u_d != nullptr ? &J_u_x : nullptr)) {
    return ProjectionStatus::kBeyondDistortionLimit;
  }
  const Vector2<S> centre = camera.optical_centre();
  const Vector2<S> pixel(f * x_d.x() + centre.x(), f * aspect * x_d.y() + centre.y());
  if (!all_finite(pixel)) return ProjectionStatus::kNotFinite;
  *u = pixel;
  if (J_u_d != nullptr) {
    J_u_x.row(0) *= f / d_c.z();
    J_u_x.row(1) *= f * aspect / d_c.z();
    *J_u_d << J_u_x, -J_u_x * x;
  }
  if (J_u_camera != nullptr) {
    J_u_camera->col(camera_column::kFocalLength) << x_d.x(), aspect * x_d.y();
    J_u_camera->col(camera_column::kAspect) << S(0), f * x_d.y();
    J_u_camera->template middleCols<kDistortionCount>(camera_column::kDistortion) =
        camera.distortion.by_terms(x, f, f * aspect);
    J_u_camera->template middleCols<2>(camera_column::kCentreU).setIdentity();
  }
  return ProjectionStatus::kOk;
}

// d_c has unit length. J_d_camera: columns of camera_column.
template <class S>
[[nodiscard]] ProjectionStatus unproject(
    const Camera<S>& camera, const NonDeduced<Vector2<S>>& u, NonDeduced<Vector3<S>>* d_c,
    NonDeduced<Matrix<S, 3, 2>>* J_d_u = nullptr,
    NonDeduced<Matrix<S, 3, kCameraParameterCount>>* J_d_camera = nullptr) {
  using std::sqrt;
  const S& f = camera.focal_length;
  const S& aspect = camera.aspect;
  const Vector2<S> from_centre = u - camera.optical_centre();
  const Vector2<S> x_d(from_centre.x() / f, from_centre.y() / (f * aspect));
  if (!all_finite(x_d)) return ProjectionStatus::kNotFinite;
  typename Distortion<S>::Undistorted undistorted;
  if (!camera.distortion.undistort(x_d, &undistorted)) {
    return ProjectionStatus::kBeyondDistortionLimit;
  }
  const Vector2<S>& x = undistorted.x;
  const S z = S(1) / sqrt(S(1) + x.squaredNorm());
  const Vector3<S> d(z * x.x(), z * x.y(), z);
  if (!all_finite(d)) return ProjectionStatus::kNotFinite;
  *d_c = d;
  if (J_d_u == nullptr && J_d_camera == nullptr) return ProjectionStatus::kOk;

  Matrix<S, 3, 2> J_d_x = -z * d * d.template head<2>().transpose();
  J_d_x(0, 0) += z;
  J_d_x(1, 1) += z;
  const Matrix<S, 3, 2> J_d_xd = J_d_x * undistorted.J_x_xd();
  Matrix<S, 3, 2> J_d_pixel;
  J_d_pixel.col(0) = J_d_xd.col(0) / f;
  J_d_pixel.col(1) = J_d_xd.col(1) / (f * aspect);
  if (J_d_u != nullptr) *J_d_u = J_d_pixel;
  if (J_d_camera != nullptr) {
    J_d_camera->col(camera_column::kFocalLength) = -J_d_xd * x_d / f;
    J_d_camera->col(camera_column::kAspect) = -J_d_xd.col(1) * x_d.y() / aspect;
    J_d_camera->template middleCols<kDistortionCount>(camera_column::kDistortion) =
        undistorted.by_terms(J_d_x);
    J_d_camera->template middleCols<2>(camera_column::kCentreU) = -J_d_pixel;
  }
  return ProjectionStatus::kOk;
}

}  // namespace alidade
