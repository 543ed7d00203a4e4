#pragma once
// Whether directions of one place, by two frames, differ by as much as their sigmas claim.
//   y_p = mean of the residuals of pair p,  C_p = its covariance by both frames and the calibration
//   ratio^2 = mean of y_p^T C_p^-1 y_p / 2
// An error of the calibration counts by the difference of its effects on the two frames. It is not
// known whether the errors of two zooms are alike: both cases are tried, and the one that claims
// more counts. Errors of the two frames count as independent. Errors of a common map are not
// independent, which makes the ratio too small, never too large. Pairs are correlated if they share
// frames, and by the calibration; with R the correlations of all y_p, whitened pair by pair,
//   freedom = (trace R)^2 / |R|^2       (Satterthwaite),   freedom * ratio^2 ~ chi-square
// px, rad. Pure; allocates.

#include <functional>
#include <string>
#include <vector>

#include "edge_app/verify/pair_rows.h"

namespace alidade {

// One pair's mean over its places, for statistics and plots.
struct PairMean {
  std::size_t first = 0;                                         // index of the frame
  std::size_t second = 0;                                        // likewise
  Vector2<double> residual = Vector2<double>::Zero();            // px
  Matrix2<double> noise = Matrix2<double>::Zero();               // px^2, of the places
  Matrix<double, 2, 4> J_first = Matrix<double, 2, 4>::Zero();   // as in pair_rows.h
  Matrix<double, 2, 4> J_second = Matrix<double, 2, 4>::Zero();  // likewise
  Sensitivity<2> P_first = Sensitivity<2>::Zero();               // likewise
  Sensitivity<2> P_second = Sensitivity<2>::Zero();              // likewise
};

struct ClaimResult {
  int pairs = 0;
  int frames = 0;
  double freedom = 0;     // independent numbers behind the ratio; two a pair at most
  double rms_px = 0;      // of the lengths of y_p
  double rms_deg = 0;     // the same as an angle
  double claimed_px = 0;  // rms_px as the covariances claim it
  double ratio = 0;
  double low = 0, high = 0;  // 95 % interval of the ratio, if errors are as alike as claimed
  double log_chance = 0;     // natural; of a ratio at least as large, if the sigmas hold
};

// Means, weighted by the places' noise. noise_factor: >= 1, by which the places' variances are too
// small. Pairs whose mean is not finite are left out.
[[nodiscard]] std::vector<PairMean> pair_means(const std::vector<PairRows>& pairs,
                                               double noise_factor);

// frames: those that the pairs count, with the orientations that `from` takes.
// motion_inflation: >= 1, how many neighbouring frames share an error and count as one.
[[nodiscard]] ClaimResult check_claims(const std::vector<PairMean>& pairs,
                                       const std::vector<SeenFrame>& frames, OrientationFrom from,
                                       double motion_inflation);

// The value that chi-square with `freedom` degrees of freedom exceeds as probably as a standard
// normal number exceeds z (Wilson and Hilferty).
[[nodiscard]] double chi_square_at(double z, double freedom);

}  // namespace alidade
