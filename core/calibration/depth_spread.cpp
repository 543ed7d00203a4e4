#include "core/calibration/depth_spread.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/calibration/departure_score.h"

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

// Linear interpolation between the nodes of a grid over the scene, in pan and tilt.
class SceneGrid {
 public:
  static constexpr int kPan = 6;
  static constexpr int kTilt = 4;
  static constexpr int kNodes = kPan * kTilt;

  explicit SceneGrid(const TrajectorySpline& trajectory) : trajectory_(trajectory) {}

  void see(const ObservationRow& row) {
    const Vector2<double> place = place_of(row);
    least_ = least_.cwiseMin(place);
    most_ = most_.cwiseMax(place);
  }
  [[nodiscard]] Eigen::Matrix<double, 1, kNodes> weights(const ObservationRow& row) const {
    const Vector2<double> size = (most_ - least_).cwiseMax(1e-12);
    const Vector2<double> last(kPan - 1, kTilt - 1);
    const Vector2<double> at = ((place_of(row) - least_).cwiseQuotient(size).cwiseProduct(last))
                                   .cwiseMax(0.0)
                                   .cwiseMin(last);
    const int i = std::min(static_cast<int>(at[0]), kPan - 2);
    const int j = std::min(static_cast<int>(at[1]), kTilt - 2);
    Eigen::Matrix<double, 1, kNodes> out = Eigen::Matrix<double, 1, kNodes>::Zero();
    for (const int di : {0, 1}) {
      for (const int dj : {0, 1}) {
        out[(i + di) * kTilt + j + dj] =
            (1 - std::abs(at[0] - i - di)) * (1 - std::abs(at[1] - j - dj));
      }
    }
    return out;
  }

 private:
  [[nodiscard]] Vector2<double> place_of(const ObservationRow& row) const {
    return trajectory_.position(row.basis).vector() +
           Vector2<double>(row.d_c.x(), -row.d_c.y()) / row.d_c.z();
  }

  const TrajectorySpline& trajectory_;
  Vector2<double> least_ = Vector2<double>::Constant(1e300);
  Vector2<double> most_ = -least_;
};

// The likeliest variance of unknowns that are alike and independent, from their score. What less
// than 1e-6 is left of is the other unknowns'.
double likeliest_variance(const Eigen::MatrixXd& information, const Eigen::VectorXd& full,
                          const Eigen::VectorXd& score) {
  constexpr double kLeastLeft = 1e-6;
  constexpr double kStep = 1.2;
  constexpr int kSteps = 120;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(information);
  const Eigen::VectorXd& left = eigen.eigenvalues();
  const Eigen::VectorXd s = eigen.eigenvectors().transpose() * score;
  double largest = 0;
  for (Eigen::Index i = 0; i < s.size(); ++i) {
    if (left[i] > kLeastLeft * full.maxCoeff())
      largest = std::max(largest, s[i] * s[i] / (left[i] * left[i]));
  }
  double best = 0;
  double variance = 0;
  double v = largest;
  for (int step = 0; step < kSteps; ++step, v /= kStep) {
    double likelihood = 0;  // its logarithm, over that of 0
    for (Eigen::Index i = 0; i < s.size(); ++i) {
      if (left[i] > kLeastLeft * full.maxCoeff())
        likelihood += 0.5 * (s[i] * s[i] * v / (1 + v * left[i]) - std::log1p(v * left[i]));
    }
    if (likelihood <= best) continue;
    best = likelihood;
    variance = v;
  }
  return variance;
}

// Variance of rho o over the scene.
double variance_over_scene(const Adjustment& adjustment, const AdjustmentState& state,
                           const Linearisation& at, const ReducedFactor& factor) {
  SceneGrid grid(state.trajectory);
  adjustment.visit(
      state, at, [&](const ObservationRow& row) { grid.see(row); }, [](const TelemetryRow&) {});
  std::vector<DepartureScore> scores(1, DepartureScore(SceneGrid::kNodes, at));
  DepartureScore& score = scores.front();
  adjustment.visit(
      state, at,
      [&](const ObservationRow& row) {
        score.add(row, 0, -(row.whiten * row.J_u_dc.col(2)) * grid.weights(row));
      },
      [](const TelemetryRow&) {});
  DepartureScore::finish(factor, adjustment, &scores);
  return likeliest_variance(score.information(), score.full_information().diagonal(),
                            score.score());
}

}  // namespace

DepthSpread depth_spread(const Adjustment& adjustment, const AdjustmentState& state,
                         const Linearisation& at, const ReducedFactor& factor) {
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
  const double by_themselves =
      std::max(0.0, radius.excess / radius.square - other.excess / std::max(other.square, 1e-300));
  spread.sigma = std::sqrt(by_themselves + variance_over_scene(adjustment, state, at, factor));
  return spread;
}

DepthSpread nearness_spread(const AdjustmentState& state, const Linearisation& at) {
  constexpr int kRounds = 20;
  const std::size_t landmarks = state.nearness.size();
  DepthSpread spread;
  double variance = 0;
  for (int round = 0; round < kRounds; ++round) {
    double weights = 0;
    double mean = 0;
    const auto weight = [&](std::size_t l) {
      return at.touched_begin[l] == at.touched_begin[l + 1]
                 ? 0.0
                 : 1 / (variance + 1 / at.H_landmark[landmarks + l](0, 0));
    };
    for (std::size_t l = 0; l < landmarks; ++l) {
      weights += weight(l);
      mean += weight(l) * state.nearness[l];
    }
    if (!(weights > 0)) return spread;
    mean /= weights;
    double excess = 0;
    double squares = 0;
    spread.excess = 0;
    spread.landmarks = 0;
    for (std::size_t l = 0; l < landmarks; ++l) {
      const double w = weight(l);
      if (!(w > 0)) continue;
      const double square = std::pow(state.nearness[l] - mean, 2);
      excess += w * w * (square - 1 / at.H_landmark[landmarks + l](0, 0));
      squares += w * w;
      spread.excess += square * at.H_landmark[landmarks + l](0, 0);
      spread.landmarks += 1;
    }
    variance = std::max(0.0, excess / squares);
  }
  spread.sigma = std::sqrt(variance);
  return spread;
}

}  // namespace alidade::internal
