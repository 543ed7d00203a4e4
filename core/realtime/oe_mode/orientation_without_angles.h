#pragma once
// Motion of a frame from its landmarks, the previous frames and telemetry's rates, without
// telemetry's angles: one weighted linear solution. Internal to orientation_solve.cpp and
// orientation_inliers.cpp. No allocation.

#include "core/realtime/oe_mode/orientation_problem.h"

namespace alidade::internal {

// x at phi = 0, its change with phi, and phi from landmarks, previous frames and rates.
struct WithoutAngles {
  Vector6 x;
  Matrix6 covariance;
  LensRow row;
  Vector6 by_lens = Vector6::Zero();
  double information = 0;
  double phi = 0;  // with its prior
  double phi_information = 0;
  ZoomRows zoom;

  [[nodiscard]] MotionAndLens best() const {
    const Vector6 at = x + phi * by_lens;
    return {at, phi, zoom.at(at, phi)};
  }
};

// weights: by landmark, 0 to 1. inflation: factor for the landmarks' covariances.
[[nodiscard]] WithoutAngles solve_without_angles(const OrientationProblem& problem,
                                                 const ScaledPrior& prior, const double* weights,
                                                 double inflation, bool with_covariance);

}  // namespace alidade::internal
