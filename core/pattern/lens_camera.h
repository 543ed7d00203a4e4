#pragma once
// camera_of_lens(): the base camera (core/model/camera.h: f, aspect, one k, its centre in the middle of the image) that comes
// nearest to a lens with two focal lengths, a centre of its own, k1 k2 and p1 p2.
//   min over (f, alpha, k, R) of  sum_i |camera(R d_i) - u_i|^2,   u_i a grid over the image, d_i = lens^-1(u_i)
// R, a rotation, takes up where the lens's axis points: in a mount the axes of pan and tilt do that. For k2 = p1 = p2 = 0 and
// a centre in the middle it is k = k1 exactly.
// What is not known of the result is the lens's covariance, carried over by the derivative of the minimum, and on top what one k
// cannot express: landmarks are not spread evenly over the image, and a part of it (its middle, its rim, each half) has another
// nearest camera than the whole. The largest of these differences, parameter by parameter, counts as one standard deviation.
// Batch work: it allocates.

#include <optional>

#include "core/model/camera.h"
#include "core/pattern/lens.h"

namespace alidade {

struct LensCamera {
  Camera<double> camera;
  double line_delay = 0;  // s/row
  // Of f, alpha, k, line delay.
  Matrix<double, 4, 4> covariance = Matrix<double, 4, 4>::Zero();
  double misfit_px = 0;  // rms of what no rotation and no k takes up
};

// width, height: px, of the image that the lens is of. Empty: the lens cannot be inverted over the image.
[[nodiscard]] std::optional<LensCamera> camera_of_lens(const LensVector& lens,
                                                       const LensMatrix& covariance, int width,
                                                       int height);

}  // namespace alidade
