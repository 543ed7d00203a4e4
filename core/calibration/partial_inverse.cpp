#include "core/calibration/partial_inverse.h"

#include <Eigen/Cholesky>

namespace alidade::internal {

std::vector<int> free_places(const Eigen::MatrixXd& covariance) {
  std::vector<int> places;
  for (int i = 0; i < covariance.rows(); ++i) {
    if (covariance(i, i) > 0) places.push_back(i);
  }
  return places;
}

Eigen::MatrixXd scaled_inverse(const Eigen::MatrixXd& matrix) {
  const Eigen::VectorXd scale = matrix.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> llt(scale.asDiagonal() * matrix * scale.asDiagonal());
  if (llt.info() != Eigen::Success) return {};
  const Eigen::MatrixXd inverse =
      llt.solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
  return scale.asDiagonal() * inverse * scale.asDiagonal();
}

Eigen::MatrixXd inverse_over(const Eigen::MatrixXd& matrix, const std::vector<int>& places) {
  const Eigen::MatrixXd part = scaled_inverse(matrix(places, places));
  if (part.size() == 0) return {};
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(matrix.rows(), matrix.cols());
  result(places, places) = part;
  return result;
}

}  // namespace alidade::internal
