#include "core/realtime/oe_mode/orientation_solve.h"

#include <algorithm>
#include <cmath>

#include "core/realtime/oe_mode/orientation_inliers.h"
#include "core/realtime/oe_mode/orientation_posterior.h"

namespace alidade {
namespace {

// Into true units, and with the landmarks' residuals at x. False if the result is not finite.
bool conclude(const internal::Given& given, const internal::Posterior& posterior,
              const internal::MotionAndLens& x, FoundLandmark* landmarks,
              internal::Squares* squares, SolvedMotion* out) {
  const Vector6 unscale = given.D.cwiseInverse();
  Matrix<double, 6, 8> to_base = Matrix<double, 6, 8>::Zero();
  to_base.topLeftCorner<6, 6>() = unscale.asDiagonal();
  out->frame_covariance =
      unscale.asDiagonal() * posterior.covariance.topLeftCorner<6, 6>() * unscale.asDiagonal();
  to_base.topRightCorner<2, 2>().setIdentity();
  out->covariance = to_base * posterior.covariance * to_base.transpose();
  out->correction = unscale.cwiseProduct(posterior.solution.head<6>());
  out->offset_correction = posterior.solution.tail<2>();
  out->sensitivity = unscale.asDiagonal() * posterior.sensitivity.topRows<6>();
  out->offset_correction_sensitivity = posterior.sensitivity.bottomRows<2>();
  internal::find_squares(given.problem, x, squares);
  for (int i = 0; i < given.problem.count(); ++i) {
    landmarks[i].normalised_square = (*squares)[static_cast<std::size_t>(i)];
  }
  // An unknown that nothing determines has no finite variance. The factorisation then gives no
  // valid one.
  return all_finite(out->correction) && all_finite(out->covariance) &&
         all_finite(out->offset_correction) && out->covariance.diagonal().minCoeff() > 0;
}

}  // namespace

bool SolveLimits::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(min_half_readout_s > 0)) problem = "min_half_readout_s must be positive";
  if (!(max_scale >= 1)) problem = "max_scale must be at least 1";
  if (!(max_contradiction > 0)) problem = "max_contradiction must be positive";
  if (!(min_inlier_share >= 0 && min_inlier_share <= 1))
    problem = "min_inlier_share must be 0 to 1";
  if (min_inliers < 1) problem = "min_inliers must be at least 1";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

SolveStatus solve_orientation(FoundLandmark* landmarks, int count, const MotionPrior& prior,
                              const SolveLimits& limits, double width, double height,
                              double half_readout_s, SolvedMotion* out) {
  count = std::min(count, kMaxFoundLandmarks);
  if (count < std::max(limits.min_inliers, internal::kMinInliers)) return SolveStatus::kTooFew;
  const double unit_s = std::max(std::abs(half_readout_s), limits.min_half_readout_s);
  const internal::OrientationProblem problem(landmarks, count, unit_s, prior.lens, prior.zoom);
  const Vector6 D = problem.scaling();
  const internal::ScaledPrior scaled = internal::scaled(prior, unit_s, D);
  const internal::Given given{problem, prior, scaled, D, unit_s};

  // Which landmarks count, and how much.
  internal::Fit fit;
  if (!internal::robust_start(problem, prior, scaled, unit_s, limits, landmarks, &fit))
    return SolveStatus::kNotFinite;
  if (!internal::gate(problem, scaled, limits, landmarks, &fit)) return SolveStatus::kTooFew;
  const ResidualSquares small =
      internal::neighbours_squares(problem, landmarks, width, height, internal::kSmallCells, fit.x);
  out->large_squares = internal::neighbours_squares(
      problem, landmarks, width, height, internal::kLargeCells, fit.x, &out->large_averages);
  out->single_squares = fit.of_inliers;
  // With few neighbourhoods too little is known.
  const double inflation =
      std::max(fit.scale_square, small.freedom > 6 ? small.sum / small.freedom : 1.0);
  const internal::FromLandmarks known = internal::sums_of_landmarks(
      given, landmarks, fit.weights.data(), prior.sharing * inflation, &out->shared_covariance);

  // With telemetry's angles, unless they contradict the landmarks.
  out->contradiction = 0;
  if (prior.has_telemetry &&
      !internal::agree_with_telemetry(given, known, limits.max_contradiction, out)) {
    return SolveStatus::kContradiction;
  }
  internal::Posterior posterior;
  if (prior.lens != nullptr) {
    if (!internal::solve_with_lens(given, known, &posterior, &fit.x, out))
      return SolveStatus::kNotFinite;
  } else {
    posterior = prior.has_telemetry ? internal::solve_with_offset(given, known)
                                    : internal::posterior_of_landmarks(known);
    fit.x.x = posterior.solution.head<6>();
  }
  out->inliers = fit.inliers;
  out->inflation = inflation;
  return conclude(given, posterior, fit.x, landmarks, &fit.squares, out) ? SolveStatus::kOk
                                                                         : SolveStatus::kNotFinite;
}

}  // namespace alidade
