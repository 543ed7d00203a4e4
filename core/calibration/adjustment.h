#pragma once
// Bundle adjustment of one calibration: Levenberg-Marquardt on the exact Jacobians of linearisation.h, landmarks
// eliminated first.
// The normal equations are solved here and not by Ceres, against which the tests hold them: Ceres takes longer for the
// same minimum (docs/measurements.md), and what knots, noise and covariance need of the reduced normal matrix falls out. Landmarks tie
// distant times together on a path that returns, so the matrix left over the control points is dense: by Cholesky up to
// kLargestDirect rows, else by conjugate gradients (reduced_equations.h) and, where these do not converge, by Cholesky.
// Allocates; one object for each thread.

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

class Adjustment {
 public:
  static constexpr Eigen::Index kLargestDirect = 900;

  Adjustment(const AdjustmentData& data, const AdjustmentPriors& priors,
             const std::array<bool, kGlobalCount>& fixed,
             Eigen::Index largest_direct = kLargestDirect)
      : lineariser_(data, priors, fixed), fixed_(fixed), largest_direct_(largest_direct) {}

  void linearise(const AdjustmentState& state, const LossScales& loss, Linearisation* out) {
    lineariser_.linearise(state, loss, out);
  }

  // H x = g with the landmarks eliminated and every diagonal element of H multiplied by 1 + damping. False if
  // H is not positive definite.
  [[nodiscard]] bool solve(const Linearisation& linearisation, double damping, Eigen::VectorXd* x,
                           std::vector<Vector2<double>>* x_landmark);

  // Levenberg-Marquardt until a step promises less than `tolerance` of cost (a change of sqrt(tolerance)
  // standard deviations). The linearisation at the final state is left in *at. False if no step helps
  // although one should, or max_steps were not enough.
  [[nodiscard]] bool minimise(const LossScales& loss, int max_steps, double tolerance,
                              AdjustmentState* state, Linearisation* at);

  // Covariance of the local parameters (zero rows where fixed), and the number of unknowns that telemetry decides,
  // trace(H^-1 H_telemetry) (Helmert). False if the data leave a direction undetermined.
  [[nodiscard]] bool covariance(const Linearisation& linearisation, GlobalMatrix* covariance,
                                double* telemetry_unknowns);

  // Of each observation at the state of the latest covariance(), in units of its sigma.
  [[nodiscard]] std::vector<Influence> influences(const AdjustmentState& state,
                                                  const Linearisation& linearisation) const {
    return lineariser_.influences(state, linearisation, global_rows_);
  }

  [[nodiscard]] int steps_taken() const { return steps_taken_; }

 private:
  // So many rows that conjugate gradients are faster than Cholesky.
  [[nodiscard]] bool is_long(const Linearisation& linearisation) const {
    return linearisation.H.rows() > largest_direct_;
  }
  [[nodiscard]] bool solve_directly(const Linearisation& linearisation, double damping,
                                    Eigen::VectorXd* x);
  [[nodiscard]] bool covariance_directly(const Linearisation& linearisation,
                                         GlobalMatrix* covariance, double* telemetry_unknowns);
  [[nodiscard]] bool covariance_iteratively(const Linearisation& linearisation,
                                            GlobalMatrix* covariance, double* telemetry_unknowns);
  [[nodiscard]] bool reduce(const Linearisation& linearisation, double damping);
  // Megabytes, and what comes between two minimisations, or after the covariance, takes as much.
  void forget_reduced() { reduced_.resize(0, 0); }
  // What minimise() does.
  [[nodiscard]] bool descend(const LossScales& loss, int max_steps, double tolerance,
                             AdjustmentState* state, Linearisation* at);

  Lineariser lineariser_;
  std::array<bool, kGlobalCount> fixed_;
  Eigen::Index largest_direct_;
  int steps_taken_ = 0;
  // What served last: a few steps at a time must get as far as many at once.
  double damping_ = 1e-8;

  Eigen::MatrixXd reduced_;
  Eigen::VectorXd reduced_g_;
  GlobalRows global_rows_;  // of H^-1, landmarks eliminated; zero where fixed
};

}  // namespace alidade::internal
