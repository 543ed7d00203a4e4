#pragma once
// DepartureScore: what the residuals at the minimum show of unknowns theta that the adjustment does
// not have. To first order theta adds X theta to the errors e; X has some columns for each row.
//   score s = X^T e,   information N = X^T X - X^T J H^-1 J^T X
// Trajectory, landmarks and parameters are eliminated: what they absorb does not count. The best
// theta is N^-1 s, and s^T N^-1 s is chi-square if theta is 0. Leaving theta out moves the
// parameters by effect() theta. e is in units of its sigma, theta in those of the caller's columns.
// Derivation: docs/calibration.md. Allocates.

#include <Eigen/Core>
#include <vector>

#include "core/calibration/adjustment.h"
#include "core/calibration/linearisation.h"

namespace alidade::internal {

using DepartureColumns = Eigen::Matrix<double, 2, Eigen::Dynamic>;
using DepartureEffect = Eigen::Matrix<double, kGlobalCount, Eigen::Dynamic>;

class DepartureScore {
 public:
  // columns: the size of theta. at: the minimum of least squares, which must outlive this object
  // and must not change.
  DepartureScore(int columns, const Linearisation& at);

  // X: the row's columns first, first + 1, ...; its other columns are zero. Once for each row.
  void add(const ObservationRow& row, int first, const DepartureColumns& X);
  void add(const TelemetryRow& row, int first, const DepartureColumns& X);

  // After the last row, before the results below: eliminates for all scores of one minimum
  // together. factor: of this minimum. adjustment: its latest covariance() was of this minimum.
  static void finish(const ReducedFactor& factor, const Adjustment& adjustment,
                     std::vector<DepartureScore>* scores);

  [[nodiscard]] const Eigen::VectorXd& score() const { return score_; }
  [[nodiscard]] const Eigen::MatrixXd& information() const { return information_; }
  // The information if trajectory, landmarks and parameters were known.
  [[nodiscard]] const Eigen::MatrixXd& full_information() const { return full_; }
  // d parameters / d theta, parameters scaled as in linearisation.h.
  [[nodiscard]] const DepartureEffect& effect() const { return effect_; }

 private:
  const Linearisation* at_;
  Eigen::VectorXd score_;
  Eigen::MatrixXd information_;
  Eigen::MatrixXd full_;
  Eigen::MatrixXd cross_;                         // J^T X, of control points and parameters
  std::vector<DepartureColumns> cross_landmark_;  // likewise; empty: zero
  DepartureEffect effect_;
};

}  // namespace alidade::internal
