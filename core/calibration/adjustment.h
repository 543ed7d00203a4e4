#pragma once
// Adjustment: bundle adjustment of one calibration by Levenberg-Marquardt with the Jacobians of
// linearisation.h. Landmarks are eliminated first. Time against Ceres: docs/measurements.md.
// On a path that returns, landmarks tie distant times together, so the reduced matrix is dense. Up
// to kLargestDirect rows it is solved by Cholesky. A larger one is solved by conjugate gradients
// (reduced_equations.h), and by Cholesky if these do not converge. Allocates; one object for each
// thread.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <functional>
#include <vector>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

// Cholesky of S, the normal matrix with the landmarks eliminated.
class ReducedFactor {
 public:
  // S: its lower triangle. False if it is not positive definite.
  [[nodiscard]] bool set(Eigen::MatrixXd S);
  // K B with K^T K = S^-1. B: as many rows as S. After set() returned true.
  [[nodiscard]] Eigen::MatrixXd half_solve(const Eigen::MatrixXd& B) const;

 private:
  Eigen::VectorXd scale_;  // to a unit diagonal
  Eigen::MatrixXd L_;
};

class Adjustment {
 public:
  static constexpr Eigen::Index kLargestDirect = 900;

  // fixed: the parameters that are exact, by index in GlobalVector. largest_direct: rows of H, in
  // place of kLargestDirect. The data must outlive this object, and must not change between a
  // linearisation and the calls that take it.
  Adjustment(const AdjustmentData& data, const AdjustmentPriors& priors,
             const std::array<bool, kGlobalCount>& fixed,
             Eigen::Index largest_direct = kLargestDirect)
      : lineariser_(data, priors, fixed), fixed_(fixed), largest_direct_(largest_direct) {}

  // From now on the parameter (index in GlobalVector) keeps its value, which is taken as exact.
  void hold(int parameter) {
    fixed_[static_cast<std::size_t>(parameter)] = true;
    lineariser_.hold(parameter);
  }

  void linearise(const AdjustmentState& state, const LossScales& loss, Linearisation* out) {
    lineariser_.linearise(state, loss, out);
  }

  // Solves H x = g with landmarks eliminated and every diagonal element of H multiplied by 1 +
  // damping. *x_landmark: by block of H_landmark; a direction's change lacks what goes with the
  // nearness (Linearisation::direction_by_nearness). False if H is not positive definite.
  [[nodiscard]] bool solve(const Linearisation& linearisation, double damping, Eigen::VectorXd* x,
                           std::vector<Vector2<double>>* x_landmark);

  // Solves H x = b, landmarks eliminated, for each column of b. *step: the solution for g, that is
  // the rest of the way to the minimum. False if H is not positive definite.
  [[nodiscard]] bool solve_columns(const Linearisation& linearisation, const Eigen::MatrixXd& b,
                                   Eigen::MatrixXd* x, Eigen::VectorXd* step);

  // Levenberg-Marquardt until a step promises to reduce the cost by less than `tolerance` (a change
  // of sqrt(tolerance) standard deviations). *at: the linearisation at the final state. False if
  // the linearisation at the start is not valid, no step reduces the cost, or max_steps (rejected
  // ones included) are used up; *state is then the best so far.
  [[nodiscard]] bool minimise(const LossScales& loss, int max_steps, double tolerance,
                              AdjustmentState* state, Linearisation* at);

  // Covariance of the local parameters, scaled as in linearisation.h; rows and columns of fixed
  // ones are zero. linearisation: at the minimum, with infinite loss scales. *telemetry_unknowns:
  // trace(H^-1 H_telemetry), the number of unknowns that telemetry determines (Helmert); by
  // conjugate gradients an estimate. False if the data leave a direction undetermined.
  [[nodiscard]] bool covariance(const Linearisation& linearisation, GlobalMatrix* covariance,
                                double* telemetry_unknowns);

  // The influence of each observation; zero if it is not used. state and linearisation: those of
  // the latest covariance(), which returned true.
  [[nodiscard]] std::vector<Influence> influences(const AdjustmentState& state,
                                                  const Linearisation& linearisation) const {
    return lineariser_.influences(state, linearisation, global_rows_);
  }

  // Calls a function for each observation and each sample in use, see Lineariser.
  void visit(const AdjustmentState& state, const Linearisation& linearisation,
             const std::function<void(const ObservationRow&)>& observation,
             const std::function<void(const TelemetryRow&)>& telemetry) const {
    lineariser_.visit(state, linearisation, observation, telemetry);
  }

  // Factorises S. Takes as long as a step of Levenberg-Marquardt by Cholesky, at any size. False if
  // S is not positive definite.
  [[nodiscard]] bool factorise(const Linearisation& linearisation, ReducedFactor* factor);

  // The parameters' rows of H^-1 at the latest covariance(); zero where fixed.
  [[nodiscard]] const GlobalRows& global_rows() const { return global_rows_; }
  [[nodiscard]] const std::array<bool, kGlobalCount>& fixed() const { return fixed_; }

  // Steps of all calls of minimise(), rejected ones included.
  [[nodiscard]] int steps_taken() const { return steps_taken_; }

 private:
  // Whether conjugate gradients are faster than Cholesky.
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
  // Frees megabytes, which the steps after a minimisation or the covariance need.
  void forget_reduced() { reduced_.resize(0, 0); }
  // minimise() without freeing memory.
  [[nodiscard]] bool descend(const LossScales& loss, int max_steps, double tolerance,
                             AdjustmentState* state, Linearisation* at);

  Lineariser lineariser_;
  std::array<bool, kGlobalCount> fixed_;
  Eigen::Index largest_direct_;
  int steps_taken_ = 0;
  // The last damping that worked is kept, so several calls of a few steps get as far as one call of
  // many.
  double damping_ = 1e-8;

  Eigen::MatrixXd reduced_;
  Eigen::VectorXd reduced_g_;
  GlobalRows global_rows_;  // of H^-1, landmarks eliminated; zero where fixed
};

}  // namespace alidade::internal
