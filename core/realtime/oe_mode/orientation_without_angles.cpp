#include "core/realtime/oe_mode/orientation_without_angles.h"

#include <Eigen/Cholesky>
#include <algorithm>

namespace alidade::internal {
namespace {

// The row of phi, from landmarks and previous frames.
LensRow row_of_lens(const OrientationProblem& problem, const ScaledPrior& prior,
                    const double* weights, double inflation, const ZoomRows* zoom) {
  LensRow row = problem.lens_row(weights);
  if (zoom != nullptr) zoom->eliminate(&row);
  const Vector6 prior_c = prior.motion_information * prior.motion_by_lens;
  row.c = row.c / inflation + prior_c;
  row.information = row.information / inflation + prior_c.dot(prior.motion_by_lens);
  row.b = row.b / inflation - prior_c.dot(prior.motion);
  return row;
}

}  // namespace

WithoutAngles solve_without_angles(const OrientationProblem& problem, const ScaledPrior& prior,
                                   const double* weights, double inflation, bool with_covariance) {
  Matrix6 N;
  Vector6 b;
  problem.normal_equations(weights, &N, &b);
  WithoutAngles out;
  if (problem.zooms()) {
    out.zoom = problem.zoom_rows(weights, inflation);
    out.zoom.eliminate(&N, &b);
  }
  N /= inflation;
  b /= inflation;
  N += prior.motion_information;
  b += prior.motion_b;
  N.block<2, 2>(2, 2) += prior.rate_information;
  b.segment<2>(2) += prior.rate_information * prior.rate;
  const Eigen::LDLT<Matrix6> factor(N);
  if (with_covariance) out.covariance = factor.solve(Matrix6::Identity());
  out.x = factor.solve(b);
  const LensScale* lens = problem.lens();
  if (lens == nullptr) return out;
  out.row = row_of_lens(problem, prior, weights, inflation, problem.zooms() ? &out.zoom : nullptr);
  out.by_lens = factor.solve(out.row.c);
  // Landmarks made with this lens have no information on it, but for rounding.
  out.information = std::max(0.0, out.row.information - out.row.c.dot(out.by_lens));
  const double known = 1 / lens->variance;
  out.phi_information = out.information / prior.scale_inflation + known;
  out.phi = ((out.row.b + out.row.c.dot(out.x)) / prior.scale_inflation + known * lens->value) /
            out.phi_information;
  return out;
}

}  // namespace alidade::internal
