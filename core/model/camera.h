#pragma once
// The base camera: perspective with one term of radial distortion (PTCEE 28, 29), RDF frame.
//   x = (d_1, d_2) / d_3,   s = 1 + k |x|^2
//   u = f x_1 s + w/2 + c_u,      v = alpha f x_2 s + h/2 + c_v
// Pixels are continuous; the centre of the top-left pixel is (0.5, 0.5). Pixels outside the image
// have directions too. For k < 0 the model turns back at 3 |k| |x|^2 = 1: no direction beyond has a
// pixel, and no pixel beyond has a direction. Both ways are closed forms.
// Domain: f > 0, alpha > 0. Outputs are written with kOk only. No allocation.
// Derivation: docs/derivations.md.

#include <cmath>

#include "core/model/linear_algebra.h"
#include "core/model/projection_status.h"

namespace alidade {

template <class S>
struct Camera {
  S focal_length = S(1);       // px; f, of the horizontal direction
  S aspect = S(1);             // alpha = f_v / f_u
  S radial_distortion = S(0);  // k
  int width = 0;               // px
  int height = 0;              // px
  S centre_u = S(0);           // px; c, optical centre minus the image's middle
  S centre_v = S(0);

  template <class T>
  [[nodiscard]] Camera<T> cast() const {
    return {T(focal_length), T(aspect),   T(radial_distortion), width,
            height,          T(centre_u), T(centre_v)};
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
  // k / kappa = (f / R)^2. kappa is the distortion in the corner, R half the image's diagonal (px).
  [[nodiscard]] S distortion_of_corner() const {
    const S per_corner = focal_length / S(0.5 * std::hypot(width, height));
    return per_corner * per_corner;
  }
};

// f, alpha, k, c_u, c_v: the first five of Parameter.
inline constexpr int kCameraParameterCount = 5;

namespace internal {

// The root m of m + q m^3 = 1 on the branch through m(0) = 1. Needs q > -4/27.
template <class S>
[[nodiscard]] S undistortion_ratio(const S& q) {
  using std::abs;
  using std::asin;
  using std::log1p;
  using std::sin;
  using std::sinh;
  using std::sqrt;
  if (abs(q) < S(1e-3)) {
    return S(1) - q * (S(1) - q * (S(3) - q * (S(12) - q * (S(55) - q * (S(273) - q * S(1428))))));
  }
  const S y_squared = S(6.75) * abs(q);
  const S y = sqrt(y_squared);
  if (q < S(0)) return S(3) / y * sin(asin(y) / S(3));
  // asinh(y), which ceres::Jet lacks
  const S asinh_y = log1p(y + y_squared / (S(1) + sqrt(S(1) + y_squared)));
  return S(3) / y * sinh(asinh_y / S(3));
}

}  // namespace internal

// d_c need not have unit length. J_u_camera: columns f, alpha, k, c_u, c_v.
template <class S>
[[nodiscard]] ProjectionStatus project(
    const Camera<S>& camera, const NonDeduced<Vector3<S>>& d_c, NonDeduced<Vector2<S>>* u,
    NonDeduced<Matrix<S, 2, 3>>* J_u_d = nullptr,
    NonDeduced<Matrix<S, 2, kCameraParameterCount>>* J_u_camera = nullptr) {
  if (!all_finite(d_c)) return ProjectionStatus::kNotFinite;
  if (d_c.z() <= S(0)) return ProjectionStatus::kBehindCamera;
  const S& f = camera.focal_length;
  const S& aspect = camera.aspect;
  const S& k = camera.radial_distortion;
  const Vector2<S> x = d_c.template head<2>() / d_c.z();
  const S r_squared = x.squaredNorm();
  if (S(1) + S(3) * k * r_squared <= S(0)) return ProjectionStatus::kBeyondDistortionLimit;

  const S scale = S(1) + k * r_squared;
  const Vector2<S> x_d = scale * x;
  const Vector2<S> centre = camera.optical_centre();
  const Vector2<S> pixel(f * x_d.x() + centre.x(), f * aspect * x_d.y() + centre.y());
  if (!all_finite(pixel)) return ProjectionStatus::kNotFinite;
  *u = pixel;
  if (J_u_d != nullptr) {
    Matrix2<S> J_u_x = scale * Matrix2<S>::Identity() + S(2) * k * x * x.transpose();
    J_u_x.row(0) *= f / d_c.z();
    J_u_x.row(1) *= f * aspect / d_c.z();
    *J_u_d << J_u_x, -J_u_x * x;
  }
  if (J_u_camera != nullptr) {
    *J_u_camera << x_d.x(), S(0), f * r_squared * x.x(), S(1), S(0),  //
        aspect * x_d.y(), f * x_d.y(), f * aspect * r_squared * x.y(), S(0), S(1);
  }
  return ProjectionStatus::kOk;
}

// d_c has unit length. J_d_camera: columns f, alpha, k, c_u, c_v.
template <class S>
[[nodiscard]] ProjectionStatus unproject(
    const Camera<S>& camera, const NonDeduced<Vector2<S>>& u, NonDeduced<Vector3<S>>* d_c,
    NonDeduced<Matrix<S, 3, 2>>* J_d_u = nullptr,
    NonDeduced<Matrix<S, 3, kCameraParameterCount>>* J_d_camera = nullptr) {
  using std::sqrt;
  const S& f = camera.focal_length;
  const S& aspect = camera.aspect;
  const S& k = camera.radial_distortion;
  const Vector2<S> from_centre = u - camera.optical_centre();
  const Vector2<S> x_d(from_centre.x() / f, from_centre.y() / (f * aspect));
  if (!all_finite(x_d)) return ProjectionStatus::kNotFinite;
  const S r_d_squared = x_d.squaredNorm();
  const S q = k * r_d_squared;
  if (S(6.75) * q <= S(-1)) return ProjectionStatus::kBeyondDistortionLimit;
  const S m = internal::undistortion_ratio(q);
  const S slope = S(1) + S(3) * q * m * m;  // d r_d / d r; 0 at the limit
  if (slope <= S(0)) return ProjectionStatus::kBeyondDistortionLimit;
  const Vector2<S> x = m * x_d;
  const S z = S(1) / sqrt(S(1) + x.squaredNorm());
  const Vector3<S> d(z * x.x(), z * x.y(), z);
  if (!all_finite(d)) return ProjectionStatus::kNotFinite;
  *d_c = d;
  if (J_d_u == nullptr && J_d_camera == nullptr) return ProjectionStatus::kOk;

  const S dm_dq = -m * m * m / slope;
  const Matrix2<S> J_x_xd = m * Matrix2<S>::Identity() + S(2) * k * dm_dq * x_d * x_d.transpose();
  Matrix<S, 3, 2> J_d_x = -z * d * d.template head<2>().transpose();
  J_d_x(0, 0) += z;
  J_d_x(1, 1) += z;
  const Matrix<S, 3, 2> J_d_xd = J_d_x * J_x_xd;
  Matrix<S, 3, 2> J_d_pixel;
  J_d_pixel.col(0) = J_d_xd.col(0) / f;
  J_d_pixel.col(1) = J_d_xd.col(1) / (f * aspect);
  if (J_d_u != nullptr) *J_d_u = J_d_pixel;
  if (J_d_camera != nullptr) {
    J_d_camera->col(0) = -J_d_xd * x_d / f;
    J_d_camera->col(1) = -J_d_xd.col(1) * x_d.y() / aspect;
    J_d_camera->col(2) = J_d_x * x_d * (dm_dq * r_d_squared);
    J_d_camera->template rightCols<2>() = -J_d_pixel;
  }
  return ProjectionStatus::kOk;
}

}  // namespace alidade
