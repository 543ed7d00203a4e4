#pragma once
// Covariance to information and back. Some of the quantities may be exact, and the numbers may
// differ by many orders of magnitude with their units (px and s/row). Pure; allocates.

#include <Eigen/Core>
#include <vector>

namespace alidade::internal {

// The rows of positive variance, in order.
[[nodiscard]] std::vector<int> free_places(const Eigen::MatrixXd& covariance);

// Inverse of a symmetric positive definite matrix, computed with its diagonal scaled to 1. Empty if
// the matrix is not positive definite.
[[nodiscard]] Eigen::MatrixXd scaled_inverse(const Eigen::MatrixXd& matrix);

// scaled_inverse() of the rows and columns at `places`, embedded in a matrix of full size that is
// zero elsewhere. Empty if the part at `places` is not positive definite or `places` is empty.
[[nodiscard]] Eigen::MatrixXd inverse_over(const Eigen::MatrixXd& matrix,
                                           const std::vector<int>& places);

}  // namespace alidade::internal
