#pragma once
// A covariance in units of its sigmas.

#include <cmath>

#include "core/model/linear_algebra.h"

namespace alidade {

// What has no variance stands apart, with a correlation of 1 with itself.
template <int N>
[[nodiscard]] Matrix<double, N, N> correlation_of(const Matrix<double, N, N>& covariance) {
  Matrix<double, N, N> correlation = Matrix<double, N, N>::Identity();
  for (int i = 0; i < N; ++i) {
    for (int j = 0; j < N; ++j) {
      if (covariance(i, i) > 0 && covariance(j, j) > 0)
        correlation(i, j) = covariance(i, j) / std::sqrt(covariance(i, i) * covariance(j, j));
    }
  }
  return correlation;
}

}  // namespace alidade
