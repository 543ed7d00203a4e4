#pragma once
// CentreShare: the part of a covariance C that the optical centre's error makes:
//   C = C_held + S V S^T,   S = C_xc V^-1,   V = C_cc      c the centre, x all parameters
// C_held is the covariance with the centre known exactly. S says how the parameters follow the
// centre. At a long focal length an error of the centre by c px looks like a turn of the axes by
// c / f, to well within 1e-3 of c / f: C is nearly singular, C_held is not. A factor that enlarges
// a covariance must therefore be applied to C_held, not to C.
// Rows of C: the parameters, in their units; camera_column's come first, the centre in px. Pure; no
// allocation. Derivation: docs/calibration.md.

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/model/lens/camera.h"
#include "core/model/linear_algebra.h"

namespace alidade::internal {

template <int n>
struct CentreShare {
  Matrix<double, n, 2> slope = Matrix<double, n, 2>::Zero();  // S
  Matrix2<double> covariance = Matrix2<double>::Zero();       // V, px^2

  // False: the centre is exact in u or v, or V was not positive definite.
  [[nodiscard]] bool exists() const { return covariance.diagonal().minCoeff() > 0; }
  // S V S^T.
  [[nodiscard]] Matrix<double, n, n> part() const { return slope * covariance * slope.transpose(); }
};

// Does not exist if the centre is exact in u or v, or V is not positive definite.
template <int n>
[[nodiscard]] CentreShare<n> centre_share(const Matrix<double, n, n>& covariance) {
  constexpr int c = camera_column::kCentreU;
  CentreShare<n> share;
  const Matrix2<double> V = covariance.template block<2, 2>(c, c);
  if (!(V.diagonal().minCoeff() > 0) || !(V.determinant() > 0)) return share;
  share.covariance = V;
  share.slope = covariance.template middleCols<2>(c) * V.inverse();
  share.slope.template middleRows<2>(c).setIdentity();
  return share;
}

// C_held; C itself if the share does not exist. Rows and columns of the centre are zero; no
// variance is negative.
template <int n>
[[nodiscard]] Matrix<double, n, n> with_centre_held(const Matrix<double, n, n>& covariance,
                                                    const CentreShare<n>& share) {
  constexpr int c = camera_column::kCentreU;
  if (!share.exists()) return covariance;
  Matrix<double, n, n> held = covariance - share.part();
  held.template middleCols<2>(c).setZero();
  held.template middleRows<2>(c).setZero();
  held.diagonal() = held.diagonal().cwiseMax(0.0);
  return held;
}

// V after the data's information on the centre is divided by `growth` (less than 1 counts as 1).
// The prior's information stays. prior_sigma: px, > 0, of each component; V, which includes this
// prior, is smaller than prior_sigma^2.
[[nodiscard]] inline Matrix2<double> grown_centre(const Matrix2<double>& V, double prior_sigma,
                                                  double growth) {
  const double prior = 1 / (prior_sigma * prior_sigma);
  Matrix2<double> information = V.inverse();
  information.diagonal().array() -= prior;
  Matrix2<double> grown = information / std::max(1.0, growth);
  grown.diagonal().array() += prior;
  return grown.inverse();
}

}  // namespace alidade::internal
