#pragma once
// FadingFit: the sums of a least-squares fit of y = row . x in which older measurements count less.
// Fixed memory, no allocation. One thread.

#include "core/model/linear_algebra.h"

namespace alidade {

template <int kUnknowns>
struct FadingFit {
  using Row = Matrix<double, kUnknowns, 1>;

  Matrix<double, kUnknowns, kUnknowns> normal = Matrix<double, kUnknowns, kUnknowns>::Zero();
  Row gradient = Row::Zero();
  double square = 0;  // of all y, in their standard deviations
  double weight = 0;  // count of measurements; earlier ones count less

  // keep: factor for the weight of all earlier ones, 0 to 1. information: 1 / variance of y.
  void add(double keep, const Row& row, double y, double information) {
    normal = keep * normal + information * row * row.transpose();
    gradient = keep * gradient + information * y * row;
    square = keep * square + information * y * y;
    weight = keep * weight + 1;
  }

  // All y become larger by this. Their rows must begin with 1.
  void move(double by) {
    square += by * (2 * gradient[0] + by * normal(0, 0));
    gradient += by * normal.col(0);
  }

  // Sum of squares that x leaves, if x is the minimum.
  [[nodiscard]] double left(const Row& x) const { return square - x.dot(gradient); }
};

}  // namespace alidade
