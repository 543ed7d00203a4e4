#pragma once
// camera_of_lens(): the base camera (core/model/lens/camera.h: f, aspect, one k, centre in the
// middle of the image) that is nearest to a lens with two focal lengths, its own centre, k1 k2 and
// p1 p2.
//   min over (f, alpha, k, R) of  sum_i |camera(R d_i) - u_i|^2   u_i: grid, d_i = lens^-1(u_i)
// The rotation R absorbs the direction of the lens's axis; in a mount the pan and tilt axes do. For
// k2 = p1 = p2 = 0 and a centre in the middle, k = k1 exactly. The covariance is the lens's,
// propagated by the minimum's derivative, plus the variance of what one k cannot express: the
// nearest camera for the image's middle, its rim or one half differs from the nearest camera for
// the whole image, and the largest difference of each parameter counts as one sigma. Allocates.

#include <optional>

#include "core/model/lens/camera.h"
#include "core/pattern/lens.h"

namespace alidade {

struct LensCamera {
  Camera<double> camera;
  double line_delay = 0;  // s/row
  // Covariance of f (px), alpha, k and line delay (s/row).
  Matrix<double, 4, 4> covariance = Matrix<double, 4, 4>::Zero();
  double misfit_px = 0;  // rms that no rotation and no k absorbs
};

// width, height: px, of the lens's image. Empty if the lens cannot be inverted over the image, or
// if no camera is found for all of it and for each part.
[[nodiscard]] std::optional<LensCamera> camera_of_lens(const LensVector& lens,
                                                       const LensMatrix& covariance, int width,
                                                       int height);

}  // namespace alidade
