#pragma once
// L with covariance = L L^T: each sigma times the symmetric root of the correlations, so that roots
// of like covariances are alike and units may differ by many powers of ten. A zero row stays zero.
// Pure; allocates.

#include <Eigen/Core>

namespace alidade {

// covariance: symmetric, positive semi-definite but for rounding.
[[nodiscard]] Eigen::MatrixXd covariance_root(const Eigen::MatrixXd& covariance);

}  // namespace alidade
