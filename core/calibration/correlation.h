#pragma once
// A covariance as a correlation matrix.

#include <cmath>

#include "core/model/linear_algebra.h"

namespace alidade {

// A row without variance gets the correlation 1 with itself and 0 with all others.
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
