#pragma once
// How a camera's parameters change with its focal length. The law is stated nowhere else:
//   term of order n = kappa (f / R)^n      R: half the image's diagonal, px
// kappa is the term's distortion in the corner. kappa, aspect and optical centre stay while f
// changes. ZoomQuantity numbers the quantities that describe a lens at one focal length.
// Units: px, 1. Domain: f > 0, image size > 0. Pure; no allocation.

#include <array>
#include <cmath>
#include <cstddef>

#include "core/model/calibration.h"
#include "core/model/lens/camera.h"

namespace alidade {

enum class ZoomQuantity : int {
  kLogFocalLength,
  kCornerDistortion,  // kappa of the first term, then of the others
  kCentreU = kCornerDistortion + kDistortionCount,
  kCentreV,
  kCount
};
inline constexpr int kZoomQuantityCount = static_cast<int>(ZoomQuantity::kCount);

[[nodiscard]] constexpr int index(ZoomQuantity quantity) { return static_cast<int>(quantity); }

// The parameter of a calibration that a quantity becomes.
inline constexpr std::array<Parameter, kZoomQuantityCount> kParameterOfQuantity = [] {
  std::array<Parameter, kZoomQuantityCount> out{};
  out[index(ZoomQuantity::kLogFocalLength)] = Parameter::kFocalLength;
  for (int i = 0; i < kDistortionCount; ++i) {
    out[static_cast<std::size_t>(index(ZoomQuantity::kCornerDistortion) + i)] =
        distortion_parameter(i);
  }
  out[index(ZoomQuantity::kCentreU)] = Parameter::kCentreU;
  out[index(ZoomQuantity::kCentreV)] = Parameter::kCentreV;
  return out;
}();

template <class S>
using CornerDistortion = Matrix<S, kDistortionCount, 1>;  // kappa
template <class S>
using ZoomQuantities = Matrix<S, kZoomQuantityCount, 1>;
template <class S>
using CameraColumn = Matrix<S, kCameraParameterCount, 1>;  // d camera / d a number

namespace internal {

// x^n, n >= 1
template <class S>
[[nodiscard]] S power(const S& x, int n) {
  S out = x;
  for (int i = 1; i < n; ++i) out *= x;
  return out;
}

[[nodiscard]] constexpr int order_of(int term) {
  return Distortion<double>::kOrders[static_cast<std::size_t>(term)];
}

}  // namespace internal

// The factor of each term if f is multiplied by `factor`, or log f grows by `change`.
template <class S>
[[nodiscard]] CornerDistortion<S> distortion_by_factor(const S& factor) {
  CornerDistortion<S> out;
  for (int i = 0; i < kDistortionCount; ++i) {
    out[i] = internal::power(factor, internal::order_of(i));
  }
  return out;
}
template <class S>
[[nodiscard]] CornerDistortion<S> distortion_by_zoom(const S& change) {
  using std::exp;
  CornerDistortion<S> out;
  for (int i = 0; i < kDistortionCount; ++i) out[i] = exp(S(internal::order_of(i)) * change);
  return out;
}

// d term / d kappa = (f / R)^n, of each term
template <class S>
[[nodiscard]] CornerDistortion<S> corner_unit(const Camera<S>& camera) {
  return distortion_by_factor<S>(camera.focal_length /
                                 S(0.5 * std::hypot(camera.width, camera.height)));
}

template <class S>
[[nodiscard]] CornerDistortion<S> corner_distortion(const Camera<S>& camera) {
  const CornerDistortion<S> unit = corner_unit(camera);
  CornerDistortion<S> kappa;
  for (int i = 0; i < kDistortionCount; ++i) kappa[i] = camera.distortion[i] / unit[i];
  return kappa;
}

// Sets the terms to these kappa at the camera's focal length.
template <class S>
void set_corner_distortion(const NonDeduced<CornerDistortion<S>>& kappa, Camera<S>* camera) {
  const CornerDistortion<S> unit = corner_unit(*camera);
  for (int i = 0; i < kDistortionCount; ++i) camera->distortion[i] = kappa[i] * unit[i];
}

// Multiplies f by `factor`, which is > 0.
template <class S>
void zoom_by(const NonDeduced<S>& factor, Camera<S>* camera) {
  camera->focal_length *= factor;
  const CornerDistortion<S> of_distortion = distortion_by_factor<S>(factor);
  for (int i = 0; i < kDistortionCount; ++i) camera->distortion[i] *= of_distortion[i];
}

// The camera with log f increased by `change`.
template <class S>
[[nodiscard]] Camera<S> zoomed(const Camera<S>& camera, const NonDeduced<S>& change) {
  using std::exp;
  Camera<S> out = camera;
  zoom_by(exp(change), &out);
  return out;
}

// d camera / d log f
template <class S>
[[nodiscard]] CameraColumn<S> by_zoom(const Camera<S>& camera) {
  CameraColumn<S> out = CameraColumn<S>::Zero();
  out[camera_column::kFocalLength] = camera.focal_length;
  for (int i = 0; i < kDistortionCount; ++i) {
    out[camera_column::kDistortion + i] = S(internal::order_of(i)) * camera.distortion[i];
  }
  return out;
}

// d y / d log f, from y's Jacobian by the camera.
template <class S, int kRows>
[[nodiscard]] Matrix<S, kRows, 1> by_zoom(const Camera<S>& camera,
                                          const Matrix<S, kRows, kCameraParameterCount>& J_camera) {
  const CameraColumn<S> along = by_zoom(camera);
  Matrix<S, kRows, 1> out =
      along[camera_column::kFocalLength] * J_camera.col(camera_column::kFocalLength);
  for (int i = camera_column::kDistortion; i < camera_column::kCentreU; ++i) {
    out += along[i] * J_camera.col(i);
  }
  return out;
}

// In place: d y / d (camera zoomed by `factor`) becomes d y / d (camera before).
template <class Derived>
void refer_to_unzoomed(const typename Derived::Scalar& factor,
                       Eigen::MatrixBase<Derived>* J_camera) {
  J_camera->col(camera_column::kFocalLength) *= factor;
  const auto of_distortion = distortion_by_factor(factor);
  for (int i = 0; i < kDistortionCount; ++i) {
    J_camera->col(camera_column::kDistortion + i) *= of_distortion[i];
  }
}

template <class S>
[[nodiscard]] ZoomQuantities<S> zoom_quantities(const Camera<S>& camera) {
  using std::log;
  ZoomQuantities<S> y;
  y << log(camera.focal_length), corner_distortion(camera), camera.centre_offset();
  return y;
}

// Aspect and image size stay.
template <class S>
void set_zoom_quantities(const NonDeduced<ZoomQuantities<S>>& y, Camera<S>* camera) {
  using std::exp;
  camera->focal_length = exp(y[index(ZoomQuantity::kLogFocalLength)]);
  set_corner_distortion(
      y.template segment<kDistortionCount>(index(ZoomQuantity::kCornerDistortion)), camera);
  camera->set_centre_offset(y.template tail<2>());
}

template <class S>
using ZoomQuantityMatrix = Matrix<S, kZoomQuantityCount, kZoomQuantityCount>;

// d (the camera's parameters in the order of ZoomQuantity) / d quantities
template <class S>
[[nodiscard]] ZoomQuantityMatrix<S> by_zoom_quantities(const Camera<S>& camera) {
  constexpr int kOfF = index(ZoomQuantity::kLogFocalLength);
  const CameraColumn<S> along = by_zoom(camera);
  const CornerDistortion<S> unit = corner_unit(camera);
  ZoomQuantityMatrix<S> J = ZoomQuantityMatrix<S>::Identity();
  J(kOfF, kOfF) = camera.focal_length;
  for (int i = 0; i < kDistortionCount; ++i) {
    const int term = index(ZoomQuantity::kCornerDistortion) + i;
    J(term, kOfF) = along[camera_column::kDistortion + i];
    J(term, term) = unit[i];
  }
  return J;
}

// The inverse of by_zoom_quantities().
template <class S>
[[nodiscard]] ZoomQuantityMatrix<S> zoom_quantities_by_camera(const Camera<S>& camera) {
  constexpr int kOfF = index(ZoomQuantity::kLogFocalLength);
  const CameraColumn<S> along = by_zoom(camera);
  const CornerDistortion<S> unit = corner_unit(camera);
  ZoomQuantityMatrix<S> J = ZoomQuantityMatrix<S>::Identity();
  J(kOfF, kOfF) = S(1) / camera.focal_length;
  for (int i = 0; i < kDistortionCount; ++i) {
    const int term = index(ZoomQuantity::kCornerDistortion) + i;
    J(term, kOfF) = -along[camera_column::kDistortion + i] / (unit[i] * camera.focal_length);
    J(term, term) = S(1) / unit[i];
  }
  return J;
}

}  // namespace alidade
