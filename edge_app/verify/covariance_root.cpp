#include "edge_app/verify/covariance_root.h"

#include <Eigen/Eigenvalues>

namespace alidade {

Eigen::MatrixXd covariance_root(const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  Eigen::VectorXd inverse = sigma;
  for (double& each : inverse) each = each > 0 ? 1 / each : 0;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(inverse.asDiagonal() * covariance *
                                                              inverse.asDiagonal());
  return sigma.asDiagonal() * solver.eigenvectors() *
         solver.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
         solver.eigenvectors().transpose();
}

}  // namespace alidade
