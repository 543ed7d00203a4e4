#pragma once
// SmoothFlow: how a far scene moves from one frame to the next, as a cubic polynomial of the place in the
// image, fitted robustly.
//
//   moved(x, y) = sum over i + j <= 3 of c_ij x^i y^j,   (x, y) = (u - centre) / (width / 2)
//
// A turning camera moves an image without parallax: whatever its focal length, its distortion and its
// rolling shutter, the motion is smooth over the image, and a polynomial holds it without knowing any of
// them. With a field of 60 degrees and k r^2 = 7 % in the corners, at 77 px a frame: to 0.2 px.
// Terms have priors in proportion to the motion, so that few or bunched samples bend nothing.
// Samples that contradict the others are weighted down (Geman and McClure), scale from their median. Of
// the image's middle up to a third may move by itself; at an edge without other samples the polynomial bends.
// Pixels. Memory is taken by the constructor; nothing else allocates, waits or throws.

#include <Eigen/Core>
#include <vector>

#include "core/model/linear_algebra.h"

namespace alidade {

struct FlowSample {
  Vector2<double> at;     // px, in the frame before
  Vector2<double> moved;  // px, from there to now
};

class SmoothFlow {
 public:
  SmoothFlow(int width, int height, int max_samples);

  void set_uniform(const Vector2<double>& moved);

  // Starts from the flow that stands, which must be right to a few times the samples' errors; at most
  // max_samples are used. Returns the standard deviation of what is left, each component, but at least
  // `sigma`; with fewer than 4 samples the flow stays and infinity is returned.
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
  std::vector<double> distances_;  // of the samples from the flow
  std::vector<double> sorted_;
};

}  // namespace alidade
