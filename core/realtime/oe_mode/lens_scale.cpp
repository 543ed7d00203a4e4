#include "core/realtime/oe_mode/lens_scale.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace alidade {
namespace {

constexpr int kOfF = camera_column::kFocalLength;

}  // namespace

LensScale LensScale::begin(const Calibration& calibration) {
  LensScale out;
  const ParameterCovariance<double>& P = calibration.covariance;
  out.direction.head<kCameraParameterCount>() = by_zoom(calibration.camera);
  for (int k = camera_column::kDistortion; k < camera_column::kCentreU; ++k) {
    if (!(P(k, k) > 0)) out.direction[k] = 0;
  }
  const double f = calibration.camera.focal_length;
  const double variance = P(kOfF, kOfF) / (f * f);
  if (!(variance > 0) || !std::isfinite(variance)) return out;
  // e = T (errors of the calibration)
  ParameterCovariance<double> T = ParameterCovariance<double>::Identity();
  T.col(kOfF) -= out.direction / f;
  T(kOfF, kOfF) = 0;
  out.others = T * P * T.transpose();
  out.others = symmetric<kParameterCount>(out.others);
  const ParameterDirection with_phi = T * P.col(kOfF) / f;
  // The part of phi that e explains goes into the sensitivity, the rest into the noise. Exact
  // parameters explain nothing.
  ParameterDirection scale = ParameterDirection::Zero();
  for (int i = 0; i < kParameterCount; ++i) {
    if (out.others(i, i) > 0) scale[i] = 1 / std::sqrt(out.others(i, i));
  }
  constexpr double kRounding = 1e-9;  // of a correlation
  ParameterCovariance<double> correlation = scale.asDiagonal() * out.others * scale.asDiagonal();
  for (int i = 0; i < kParameterCount; ++i) {
    correlation(i, i) = scale[i] > 0 ? 1 + kRounding : 1;
  }
  const ParameterDirection told = correlation.ldlt().solve(scale.cwiseProduct(with_phi));
  out.sensitivity = scale.cwiseProduct(told).transpose();
  const double rest = variance - out.sensitivity.dot(with_phi.transpose());
  // An invalid covariance would leave a negative rest.
  if (!all_finite(out.sensitivity) || !(rest > 0)) {
    out.sensitivity.setZero();
    out.variance = variance;
  } else {
    out.variance = rest;
  }
  out.learnt = true;
  return out;
}

void LensScale::learn(double measurement, double information, const Sensitivity<1>& its_sensitivity,
                      Vector2<double>* offset, Matrix2<double>* offset_covariance,
                      Sensitivity<2>* offset_sensitivity) {
  if (!learnt || !(information > 0)) return;
  const double gain_information = information / (1 + information * variance);
  const double innovation = measurement - value;
  const Sensitivity<1> of_innovation = its_sensitivity - sensitivity;
  const Vector2<double> offset_gain = gain_information * covariance_with_offset;
  const double gain = gain_information * variance;
  *offset += offset_gain * innovation;
  *offset_sensitivity += offset_gain * of_innovation;
  *offset_covariance -= offset_gain * covariance_with_offset.transpose();
  *offset_covariance = symmetric(*offset_covariance);
  make_independent(offset_sensitivity);
  value += gain * innovation;
  sensitivity += gain * of_innovation;
  covariance_with_offset *= 1 - gain;
  variance *= 1 - gain;
}

Calibration LensScale::at(const Calibration& calibration, double phi, double phi_variance,
                          const Sensitivity<1>& phi_sensitivity) const {
  Calibration out = calibration;
  const ParameterDirection a = move(phi, &out.camera);
  const ParameterDirection with_phi = others * phi_sensitivity.transpose();
  const double total = phi_variance + phi_sensitivity.dot(with_phi.transpose());
  out.covariance =
      others + total * a * a.transpose() + a * with_phi.transpose() + with_phi * a.transpose();
  return out;
}

void LensScale::move_calibration(double phi, Calibration* calibration) {
  direction = move(phi, &calibration->camera);
  value -= phi;
}

ParameterDirection LensScale::move(double phi, Camera<double>* camera) const {
  const double factor = std::exp(phi);
  const Distortion<double> before = camera->distortion;
  zoom_by(factor, camera);
  for (int i = 0; i < kDistortionCount; ++i) {
    const bool is_exact = direction[camera_column::kDistortion + i] == 0;
    if (is_exact) camera->distortion[i] = before[i];
  }
  Matrix<double, 1, kParameterCount> moved = direction.transpose();
  refer_to_unzoomed(factor, &moved);
  return moved.transpose();
}

LensColumns::LensColumns(const LensScale& lens, const Camera<double>& camera)
    : along(by_zoom(camera)),
      map_along(lens.direction.head<kCameraParameterCount>()),
      of_map(distortion_by_factor(along[kOfF] / map_along[kOfF])) {}

void LensColumns::to_frame(ParameterCovariance<double>* covariance) const {
  ParameterCovariance<double> D = ParameterCovariance<double>::Identity();
  D(kOfF, kOfF) = along[kOfF] / map_along[kOfF];
  for (int i = 0; i < kDistortionCount; ++i) {
    const int k = camera_column::kDistortion + i;
    D(k, kOfF) = (along[k] - of_map[i] * map_along[k]) / map_along[kOfF];
    D(k, k) = of_map[i];
  }
  *covariance = (D * *covariance * D.transpose()).eval();
  *covariance = symmetric<kParameterCount>(*covariance);
}

}  // namespace alidade
