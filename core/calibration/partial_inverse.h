#pragma once
// Covariance to information and back, of numbers some of which are exact, whose units differ by many orders of magnitude: px beside
// s/row. Pure; allocates.

#include <Eigen/Core>
#include <vector>

namespace alidade::internal {

// Rows of positive variance, in order.
[[nodiscard]] std::vector<int> free_places(const Eigen::MatrixXd& covariance);

// Of a symmetric positive definite matrix, in units of its diagonal's roots; empty if it is none.
[[nodiscard]] Eigen::MatrixXd scaled_inverse(const Eigen::MatrixXd& matrix);

// scaled_inverse() of the rows and columns at `places`, where it stands in a matrix of the same size that is zero elsewhere; empty if
// that part is not positive definite, or there are no places.
[[nodiscard]] Eigen::MatrixXd inverse_over(const Eigen::MatrixXd& matrix,
                                           const std::vector<int>& places);

}  // namespace alidade::internal
