#pragma once
// SmoothFlow: motion of a far scene from one frame to the next, as a cubic polynomial of the
// position in the image, fitted robustly. Units: px.
//   moved(x, y) = sum over i + j <= 3 of c_ij x^i y^j,   (x, y) = (u - centre) / (width / 2)
// A turning camera moves the image without parallax, and smoothly for any focal length, distortion
// and rolling shutter (how well the polynomial fits: docs/derivations.md). Priors proportional to
// the motion prevent few or bunched samples from bending the polynomial. Outliers are down-weighted
// (Geman and McClure), scaled by the median: up to a third of the image's middle may move by
// itself. The constructor takes all memory; nothing else allocates, waits or throws.

#include <Eigen/Core>
#include <vector>

#include "core/model/linear_algebra.h"

namespace alidade {

struct FlowSample {
  Vector2<double> at;     // px, in the previous frame
  Vector2<double> moved;  // px, from there to now
};

class SmoothFlow {
 public:
  SmoothFlow(int width, int height, int max_samples);

  // The same motion everywhere, px.
  void set_uniform(const Vector2<double>& moved);

  // Starts from the present flow, which must be right to a few times the samples' errors. Uses at
  // most max_samples. Returns the standard deviation of the residuals per component (px), but at
  // least `sigma` (px, > 0; of a sample). With fewer than 4 samples the flow is unchanged and the
  // result is infinity.
  double fit(const FlowSample* samples, int count, double sigma);

  [[nodiscard]] Vector2<double> at(const Vector2<double>& u) const;
  [[nodiscard]] Matrix2<double> gradient(const Vector2<double>& u) const;  // d moved / d u

 private:
  static constexpr int kTerms = 10;
  using Terms = Eigen::Matrix<double, kTerms, 1>;

  [[nodiscard]] Terms terms(const Vector2<double>& u) const;
  [[nodiscard]] double left_over(const FlowSample* samples, int count);

  Vector2<double> centre_;
  double per_px_;
  Eigen::Matrix<double, kTerms, 2> coefficients_;
  std::vector<double> distances_;  // px, of the samples from the flow
  std::vector<double> sorted_;
};

}  // namespace alidade
