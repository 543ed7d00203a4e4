#include "core/calibration/shared_errors.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>

namespace alidade::internal {

namespace {

// With fewer clusters a variance is known too poorly.
constexpr double kLeastFreedom = 4;

// Inverse covariance of the parameters that have one, zero for the others.
GlobalMatrix information_of(const GlobalMatrix& covariance) {
  GlobalVector scale = GlobalVector::Zero();
  GlobalMatrix scaled = GlobalMatrix::Identity();
  for (int i = 0; i < kGlobalCount; ++i) {
    if (covariance(i, i) > 0) scale[i] = 1 / std::sqrt(covariance(i, i));
  }
  for (int i = 0; i < kGlobalCount; ++i) {
    for (int j = 0; j < kGlobalCount; ++j) {
      if (i != j) scaled(i, j) = scale[i] * covariance(i, j) * scale[j];
    }
  }
  return scale.asDiagonal() * scaled.ldlt().solve(GlobalMatrix::Identity()) * scale.asDiagonal();
}

// Growth beyond 1, corrected for few clusters: with n of them the mean of 1/growth is n / (n - 2).
double excess(const ErrorGrowth& growth, int parameter) {
  const double n = growth.freedom[parameter];
  if (n < kLeastFreedom) return 0;
  return std::max(0.0, growth.ratio[parameter] * n / (n - 2) - 1);
}

}  // namespace

ErrorGrowth error_growth(const std::vector<int>& cluster, int clusters, const AdjustmentData& data,
                         const Linearisation& at, const std::vector<Influence>& influences,
                         const GlobalMatrix& covariance) {
  const auto count = static_cast<std::size_t>(clusters);
  std::vector<GlobalVector> moved(count, GlobalVector::Zero());
  std::vector<GlobalMatrix> expected(count, GlobalMatrix::Zero());
  for (std::size_t i = 0; i < influences.size(); ++i) {
    if (!data.observations[i].used) continue;
    const auto c = static_cast<std::size_t>(cluster[i]);
    const Influence& F = influences[i];
    moved[c] += F * at.observations[i].error;
    expected[c] += F * F.transpose();
  }
  const GlobalMatrix information = information_of(covariance);
  GlobalVector square = GlobalVector::Zero();
  GlobalVector sum = GlobalVector::Zero();
  GlobalVector sum_of_squares = GlobalVector::Zero();
  for (std::size_t c = 0; c < count; ++c) {
    // The parameters follow the cluster's own errors, which makes its residuals that much smaller.
    const GlobalVector left =
        (expected[c] - expected[c] * information * expected[c]).diagonal().cwiseMax(0.0);
    square += moved[c].cwiseAbs2();
    sum += left;
    sum_of_squares += left.cwiseAbs2();
  }
  ErrorGrowth growth;
  for (int p = 0; p < kGlobalCount; ++p) {
    if (!(sum[p] > 0)) continue;
    growth.ratio[p] = square[p] / sum[p];
    growth.freedom[p] = sum[p] * sum[p] / sum_of_squares[p];
  }
  return growth;
}

GlobalVector shared_error_growth(const AdjustmentData& data, const Linearisation& at,
                                 const std::vector<Influence>& influences,
                                 const GlobalMatrix& covariance) {
  std::vector<int> landmark;
  std::vector<int> frame;
  for (const auto& o : data.observations) {
    landmark.push_back(o.landmark);
    frame.push_back(o.frame);
  }
  const ErrorGrowth by_landmark = error_growth(landmark, static_cast<int>(at.H_landmark.size()),
                                               data, at, influences, covariance);
  const ErrorGrowth by_frame = error_growth(frame, static_cast<int>(data.frame_time_s.size()), data,
                                            at, influences, covariance);
  GlobalVector growth = GlobalVector::Ones();
  for (int p = 0; p < kGlobalCount; ++p) growth[p] += excess(by_landmark, p) + excess(by_frame, p);
  return growth;
}

GlobalMatrix grown_covariance(const std::vector<Influence>& influences, const GlobalVector& growth,
                              const GlobalMatrix& covariance) {
  GlobalMatrix of_observations = GlobalMatrix::Zero();
  for (const Influence& F : influences) of_observations += F * F.transpose();
  const GlobalVector root = growth.cwiseSqrt();
  return covariance - of_observations + root.asDiagonal() * of_observations * root.asDiagonal();
}

}  // namespace alidade::internal
