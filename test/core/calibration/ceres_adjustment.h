#pragma once
// The adjustment of core/calibration/adjustment.h a second time, by Ceres: the yardstick of its minimum, its
// covariance and its speed. Same residuals, priors, losses and parameters; directions are ceres::Manifolds.
// Analytic cost functions; everything that observations share is computed once for each point. Every
// block that a landmark meets has two local parameters, (log f, distortion), the optical centre, (read-out time, shift), an axis, a
// control point, so that the Schur complement runs in Ceres's code for the sizes 2, 2, 2 as long as
// the aspect is fixed. (All of them in one block would be an eighth faster.)
// Row of an observation: kObserved is the residual of adjustment.h, one Newton step from the observed row, with A held
// in its derivative. kProjected takes a second step: the full projection, whose Jacobian is exact.
// Ceres wants to know beforehand which control points a residual meets: a residual that leaves its segment goes
// on along its polynomial, and at_home() tells that the problem must be made anew.
// Single thread; allocates; throws nothing.

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "core/calibration/adjustment.h"

namespace alidade::test {

enum class ObservationRow { kObserved, kProjected };

class CeresAdjustment {
 public:
  CeresAdjustment(const ::alidade::internal::AdjustmentData& data,
                  const ::alidade::internal::AdjustmentPriors& priors,
                  const std::array<bool, ::alidade::internal::kGlobalCount>& fixed,
                  const ::alidade::internal::LossScales& loss, ObservationRow row,
                  const ::alidade::internal::AdjustmentState& start);
  ~CeresAdjustment();
  CeresAdjustment(const CeresAdjustment&) = delete;
  CeresAdjustment& operator=(const CeresAdjustment&) = delete;

  // A landmark-first ordering and the given linear solver; tolerances as in Adjustment::minimise.
  [[nodiscard]] static ceres::Solver::Options options(ceres::LinearSolverType solver,
                                                      double relative_tolerance);

  // One run of the solver on the segments of the start.
  ceres::Solver::Summary solve(ceres::Solver::Options options);

  // False if a residual has left the segment that it was given.
  [[nodiscard]] bool at_home() const;

  [[nodiscard]] const ::alidade::internal::AdjustmentState& state() const;

  // Robustified residuals and their Jacobian at the current state. Columns: control points, globals,
  // landmarks (two each). Rows: observations in use, telemetry in use, the priors.
  void linearise(Eigen::VectorXd* residuals, Eigen::MatrixXd* J);

  [[nodiscard]] bool covariance(::alidade::internal::GlobalMatrix* covariance);

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

// The minimum, with every residual in its segment.
struct CeresMinimum {
  bool converged = false;
  int iterations = 0;
  int problems = 0;  // made anew because a residual had left its segment
  std::unique_ptr<CeresAdjustment> adjustment;
};

[[nodiscard]] CeresMinimum minimise_by_ceres(
    const ::alidade::internal::AdjustmentData& data,
    const ::alidade::internal::AdjustmentPriors& priors,
    const std::array<bool, ::alidade::internal::kGlobalCount>& fixed,
    const ::alidade::internal::LossScales& loss, ObservationRow row,
    const ceres::Solver::Options& options, const ::alidade::internal::AdjustmentState& start);

}  // namespace alidade::test
