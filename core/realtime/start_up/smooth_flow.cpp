#include "core/realtime/start_up/smooth_flow.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

namespace alidade {
namespace {

// Prior sigma of the terms of each order, relative to the motion: the limits are a field of 100
// degrees, a camera looking steeply up, and 10 % distortion.
constexpr double kPriorOfOrder[] = {100, 3, 1, 0.3};
constexpr double kLeastMotion = 4;  // px
constexpr int kOrders[] = {0, 1, 1, 2, 2, 2, 3, 3, 3, 3};
// The order rises, so that an object moving at the image's edge is excluded before a term can bend
// towards it.
constexpr int kOrderOfIteration[] = {1, 1, 2, 2, 3, 3, 3};
constexpr int kTermsOfOrder[] = {1, 3, 6, 10};
// Median length of a 2-vector of normal components, in standard deviations.
constexpr double kMedianDistance = 1.1774;
// Distance at which a sample has a quarter of its weight, in standard deviations.
constexpr double kCutOff = 2;

}  // namespace

SmoothFlow::SmoothFlow(int width, int height, int max_samples)
    : centre_(0.5 * width, 0.5 * height), per_px_(2.0 / std::max(width, 1)) {
  distances_.resize(static_cast<std::size_t>(std::max(max_samples, 1)));
  sorted_.resize(distances_.size());
  coefficients_.setZero();
}

void SmoothFlow::set_uniform(const Vector2<double>& moved) {
  coefficients_.setZero();
  coefficients_.row(0) = moved.transpose();
}

SmoothFlow::Terms SmoothFlow::terms(const Vector2<double>& u) const {
  const Vector2<double> at = per_px_ * (u - centre_);
  const double x = at.x();
  const double y = at.y();
  Terms t;
  t << 1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y;
  return t;
}

Vector2<double> SmoothFlow::at(const Vector2<double>& u) const {
  return coefficients_.transpose() * terms(u);
}

Matrix2<double> SmoothFlow::gradient(const Vector2<double>& u) const {
  const Vector2<double> at = per_px_ * (u - centre_);
  const double x = at.x();
  const double y = at.y();
  Eigen::Matrix<double, kTerms, 2> slopes;
  slopes.col(0) << 0, 1, 0, 2 * x, y, 0, 3 * x * x, 2 * x * y, y * y, 0;
  slopes.col(1) << 0, 0, 1, 0, x, 2 * y, 0, x * x, 2 * x * y, 3 * y * y;
  return per_px_ * coefficients_.transpose() * slopes;
}

// Standard deviation of a component, from the median distance. Stores the distances.
double SmoothFlow::left_over(const FlowSample* samples, int count) {
  for (int i = 0; i < count; ++i) {
    const auto slot = static_cast<std::size_t>(i);
    distances_[slot] = (samples[i].moved - at(samples[i].at)).norm();
    sorted_[slot] = distances_[slot];
  }
  const auto middle = sorted_.begin() + count / 2;
  std::nth_element(sorted_.begin(), middle, sorted_.begin() + count);
  return *middle / kMedianDistance;
}

double SmoothFlow::fit(const FlowSample* samples, int count, double sigma) {
  count = std::min(count, static_cast<int>(distances_.size()));
  if (count < 4) return std::numeric_limits<double>::infinity();
  coefficients_.bottomRows<kTerms - kTermsOfOrder[1]>().setZero();
  for (const int order : kOrderOfIteration) {
    const double scale = std::max(left_over(samples, count), sigma);
    Eigen::Matrix<double, kTerms, kTerms> H = Eigen::Matrix<double, kTerms, kTerms>::Zero();
    Eigen::Matrix<double, kTerms, 2> b = Eigen::Matrix<double, kTerms, 2>::Zero();
    for (int i = 0; i < count; ++i) {
      const double ratio = distances_[static_cast<std::size_t>(i)] / (kCutOff * scale);
      const double weight = 1 / ((1 + ratio * ratio) * (1 + ratio * ratio));
      const Terms t = terms(samples[i].at);
      H.noalias() += weight * t * t.transpose();
      b.noalias() += weight * t * samples[i].moved.transpose();
    }
    // Terms of higher orders stay zero.
    const int terms_used = kTermsOfOrder[order];
    H.rightCols(kTerms - terms_used).setZero();
    H.bottomRows(kTerms - terms_used).setZero();
    b.bottomRows(kTerms - terms_used).setZero();
    const double motion = coefficients_.row(0).norm() + kLeastMotion;
    for (int i = 0; i < kTerms; ++i) {
      const double prior = scale / (kPriorOfOrder[kOrders[i]] * motion);
      H(i, i) += prior * prior;
    }
    coefficients_ = H.llt().solve(b);
  }
  return std::max(left_over(samples, count), sigma);
}

}  // namespace alidade
