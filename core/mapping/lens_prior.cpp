#include "core/mapping/lens_prior.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace alidade {
namespace {

// Sigmas so small mean a value that was stated, not measured.
LensQuantities least_sigma() { return {1e-6, 1e-5, 0.01, 0.01}; }

struct LensSample {
  double log_f = 0;
  LensQuantities value;
  LensQuantities variance;
};

LensSample sample_of(const Calibration& calibration, const LensPriorOptions& options) {
  const ZoomQuantityMatrix<double> J = zoom_quantities_by_camera(calibration.camera);
  ZoomQuantityMatrix<double> covariance;
  for (int i = 0; i < kZoomQuantityCount; ++i) {
    for (int j = 0; j < kZoomQuantityCount; ++j) {
      covariance(i, j) =
          calibration.covariance(index(kParameterOfQuantity[static_cast<std::size_t>(i)]),
                                 index(kParameterOfQuantity[static_cast<std::size_t>(j)]));
    }
  }
  LensSample out;
  out.value = zoom_quantities(calibration.camera);
  out.log_f = out.value[0];
  out.value[0] = 0;
  out.variance = (J * covariance * J.transpose()).diagonal();
  out.variance[0] = options.held_sigma * options.held_sigma;
  for (const int i : {index(ZoomQuantity::kCentreU), index(ZoomQuantity::kCentreV)}) {
    if (!(out.variance[i] > 0)) out.variance[i] = options.centre_sigma_px * options.centre_sigma_px;
  }
  return out;
}

LensQuantities sigma_of(const LensQuantities& variance) {
  return variance.cwiseMax(0.0).cwiseSqrt().cwiseMax(least_sigma());
}

}  // namespace

LensPrior lens_prior(const ZoomCurve& curve, double first_reading, double last_reading,
                     const LensPriorOptions& options) {
  constexpr int kSamples = 400;
  std::vector<LensSample> samples;
  Calibration calibration;
  for (int i = 0; i <= kSamples; ++i) {
    const double part = static_cast<double>(i) / kSamples;
    if (curve.at(first_reading + part * (last_reading - first_reading), &calibration))
      samples.push_back(sample_of(calibration, options));
  }
  const auto [least, most] = std::minmax_element(
      samples.begin(), samples.end(),
      [](const LensSample& a, const LensSample& b) { return a.log_f < b.log_f; });
  constexpr double kBeyond = 0.02;  // of log f; the ends must be inside
  LensPrior out;
  out.lens =
      LensCurve(calibration.camera, least->log_f - kBeyond, most->log_f + kBeyond, options.spacing);
  const int count = out.lens.control_points();
  const auto rows = static_cast<Eigen::Index>(samples.size());
  Eigen::MatrixXd weights = Eigen::MatrixXd::Zero(rows, count);
  Eigen::MatrixXd values(rows, kLensQuantityCount);
  Eigen::MatrixXd variances(rows, kLensQuantityCount);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const LensSample& sample = samples[static_cast<std::size_t>(i)];
    const LensCurve::Basis at = out.lens.basis_at(sample.log_f);
    weights.row(i).segment<4>(at.segment) = at.weight;
    values.row(i) = sample.value;
    variances.row(i) = sample.variance;
  }
  // Least squares; where readings are far apart in log f, the shortest solution.
  const Eigen::MatrixXd points = weights.completeOrthogonalDecomposition().solve(values);
  for (int i = 0; i < count; ++i) {
    out.lens.control_point(i) = points.row(i);
    const Eigen::VectorXd share = weights.col(i) / std::max(1e-12, weights.col(i).sum());
    out.sigmas.push_back(sigma_of(LensQuantities(variances.transpose() * share)));
  }
  return out;
}

LensPrior lens_prior(const Calibration& calibration, const LensPriorOptions& options) {
  LensPrior out;
  out.lens = LensCurve::of(calibration.camera);
  out.sigmas.assign(static_cast<std::size_t>(out.lens.control_points()),
                    sigma_of(sample_of(calibration, options).variance));
  return out;
}

}  // namespace alidade
