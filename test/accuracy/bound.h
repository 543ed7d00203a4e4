#pragma once
// The smallest standard deviations that any unbiased estimator can reach on a simulated recording: the
// inverse of the information matrix at the truth (Cramer, Rao), with nothing of the estimator in it.
// Unknowns:     parameters; offset and period of both clocks; the trajectory, a uniform cubic B-spline
//               with knots 0.25 s apart; every landmark (two angles each)
// Measurements: pixels, pan and tilt samples, stamps of both streams (stamp = offset + n period +
//               noise), the two measured periods, and the priors that the estimator is given
// A pixel (u, v) = P(p(t + v l)) solves an equation for its row: by the implicit function theorem
//   du/dx = (I - dP/dp p' l e_v^T)^-1 dP/dx.
// dP/dx are central differences of the simulator's own projection. Outliers carry no information.
// Knots 0.25 s apart and exact clocks are what `limit.yaml` of the published data was made with.
// rad, s, px. Allocates; pure.

#include <Eigen/Core>

#include "test/support/simulated_recording.h"

namespace alidade::test {

using ParameterVector = Eigen::Matrix<double, kParameterCount, 1>;
using ParameterMatrix = Eigen::Matrix<double, kParameterCount, kParameterCount>;

struct Bound {
  bool ok = false;  // false: the data leave a direction undetermined
  // In the order of Parameter; zero rows where a parameter is given. Axes in pan_basis and tilt_basis.
  ParameterMatrix covariance = ParameterMatrix::Zero();
  Eigen::Matrix<double, 3, 2> pan_basis;
  Eigen::Matrix<double, 3, 2> tilt_basis;
  ParameterVector prior_sigma = ParameterVector::Zero();  // 0: none, or given exactly
};

[[nodiscard]] Bound compute_bound(const Simulation& simulation, const SimulatedRecording& recording,
                                  const CalibrationOptions& options);

// The mean of (error / reported sigma)^2 of an efficient and honest estimator when the truth is not
// drawn from the priors but with these standard deviations about their means.
//   error = C (J^T W noise + P^-1 deviation):   1 + sum_j C_ij^2 (spread_j^2 - s_j^2) / s_j^4 / C_ii
[[nodiscard]] ParameterVector expected_nees(const Bound& bound, const ParameterVector& spread);

}  // namespace alidade::test
