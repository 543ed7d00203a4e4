#include "core/calibration/depth_spread.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace alidade::internal {

namespace {

// One column of one landmark.
struct Column {
  double score = 0;
  double information = 0;
  Vector2<double> tied = Vector2<double>::Zero();  // to the landmark's direction

  void add(const ObservationRow& row, const Vector2<double>& X) {
    score += X.dot(row.error);
    information += X.squaredNorm();
    tied += row.J_landmark.transpose() * X;
  }
};

struct Sum {
  double chi_square = 0;
  double count = 0;
  double square = 0;  // of informations
  double excess = 0;  // of squares of scores over their variance
};

Sum sum_of(const std::vector<Column>& columns, const Linearisation& at) {
  constexpr double kLeastMoved = 1e-3;
  Sum sum;
  for (std::size_t l = 0; l < columns.size(); ++l) {
    const Column& c = columns[l];
    if (!(c.information > 0)) continue;
    const double left = c.information - c.tied.dot(at.H_landmark[l].inverse() * c.tied);
    if (left < kLeastMoved * c.information) continue;
    sum.chi_square += c.score * c.score / left;
    sum.count += 1;
    sum.square += left * left;
    sum.excess += c.score * c.score - left;
  }
  return sum;
}

}  // namespace

DepthSpread depth_spread(const Adjustment& adjustment, const AdjustmentState& state,
                         const Linearisation& at) {
  constexpr double kLeastLandmarks = 20;
  std::vector<Column> along(at.H_landmark.size());
  std::vector<Column> across(at.H_landmark.size());
  adjustment.visit(
      state, at,
      [&](const ObservationRow& row) {
        const auto l = static_cast<std::size_t>(row.landmark);
        const Matrix<double, 2, 3> J = row.whiten * row.J_u_dc;
        along[l].add(row, -J.col(2));
        across[l].add(row, J * Vector3<double>(-row.d_c.y(), row.d_c.x(), 0));
      },
      [](const TelemetryRow&) {});
  const Sum radius = sum_of(along, at);
  const Sum other = sum_of(across, at);
  DepthSpread spread;
  spread.landmarks = radius.count;
  if (radius.count < kLeastLandmarks || other.count < kLeastLandmarks || !(other.chi_square > 0)) {
    return spread;
  }
  // Of the logarithm of a ratio of two mean squares.
  const double sigma = std::sqrt(2 / radius.count + 2 / other.count);
  const double z =
      std::log(radius.chi_square / radius.count * other.count / other.chi_square) / sigma;
  // Beyond 37 erfc is 0; its first term then.
  spread.log_chance = z < 30 ? std::log(0.5 * std::erfc(z / std::sqrt(2.0)))
                             : -0.5 * z * z - std::log(z * std::sqrt(2 * kPi));
  spread.excess = std::max(0.0, radius.chi_square - other.chi_square * radius.count / other.count);
  spread.sigma = std::sqrt(
      std::max(0.0, radius.excess / radius.square - other.excess / std::max(other.square, 1e-300)));
  return spread;
}

}  // namespace alidade::internal
