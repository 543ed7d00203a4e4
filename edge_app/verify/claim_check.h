#pragma once
// Whether directions of the same place, by two frames, differ by what their sigmas claim.
//   y_p = mean of a pair's residuals,  C_p = its covariance by both frames and the calibration
//   ratio^2 = mean of y_p^T C_p^-1 y_p / 2
// What both frames share cancels: errors of the calibration enter by their difference. Errors of
// the two frames count as independent, which is too much for those of a common map: then the ratio
// is small, never large. Pairs that share frames, and all that share the calibration, are
// correlated; with R the correlations of all y_p, whitened pair by pair,
//   freedom = (trace R)^2 / |R|^2       (Satterthwaite),   freedom * ratio^2 ~ chi-square
// px, rad. Pure; allocates.

#include <functional>
#include <string>
#include <vector>

#include "edge_app/verify/pair_rows.h"

namespace alidade {

// One pair's mean, for statistics and plots.
struct PairMean {
  std::size_t first = 0;
  std::size_t second = 0;
  Vector2<double> residual = Vector2<double>::Zero();  // px
  Matrix2<double> noise = Matrix2<double>::Zero();     // px^2, of the places
  Matrix<double, 2, 4> J_first = Matrix<double, 2, 4>::Zero();
  Matrix<double, 2, 4> J_second = Matrix<double, 2, 4>::Zero();
  Sensitivity<2> P = Sensitivity<2>::Zero();
};

struct ClaimResult {
  int pairs = 0;
  int frames = 0;
  double freedom = 0;  // independent numbers behind the ratio; two a pair at most
  double rms_px = 0;   // of the lengths of y_p
  double rms_deg = 0;
  double claimed_px = 0;  // what the covariances make of it
  double ratio = 0;
  double low = 0, high = 0;  // 95 % interval of the ratio, if errors are as alike as claimed
  double log_chance = 0;     // of a ratio at least as large, if sigmas hold
};

[[nodiscard]] std::vector<PairMean> pair_means(const std::vector<PairRows>& pairs,
                                               double noise_factor);

// motion: covariance of each frame's (pan, tilt, pan rate, tilt rate). motion_inflation: >= 1, how
// many neighbouring frames share an error and count as one.
[[nodiscard]] ClaimResult check_claims(const std::vector<PairMean>& pairs,
                                       const std::vector<Matrix4<double>>& motion,
                                       const ParameterCovariance<double>& parameters,
                                       double motion_inflation, double focal_length);

// Value that chi-square with `freedom` exceeds with the probability of a normal value beyond z
// (Wilson and Hilferty).
[[nodiscard]] double chi_square_at(double z, double freedom);

}  // namespace alidade
