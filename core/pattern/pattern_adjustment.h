#pragma once
// Joint adjustment of pose curve and lens (Oth 7, with theta the whole lens) to all observations,
// with a weak prior on the curve's accelerations (Oth, section 4.1) and the prior knowledge of the
// lens. Uses Ceres, with analytic Jacobians.

#include <optional>
#include <vector>

#include "core/pattern/lens.h"
#include "core/pattern/pattern_data.h"
#include "core/pattern/pose_curve.h"

namespace alidade::internal {

struct PatternState {
  LensVector lens = LensVector::Zero();
  PoseCurve curve;
};

struct PatternAdjustmentOptions {
  double sigma_px = 1;          // of an observation's coordinate
  double robust_scale = 0;      // of the Cauchy loss, in sigmas; 0: least squares
  double position_noise = 100;  // prior: power density of the accelerations, (m/s^2)^2 s
  double rotation_noise = 1e4;  // (rad/s^2)^2 s
  int max_steps = 30;
  // First trust region, in Ceres's units. Small far from the solution, so that no step runs wild.
  // Large near it, where a small one would keep weakly determined parameters from moving.
  double first_radius = 1e4;
  double relative_decrease = 1e-7;  // of the cost in a step; with less the adjustment ends
};

// Mean over the whole curve, (m/s^2)^2 and (rad/s^2)^2.
[[nodiscard]] PoseVector mean_square_acceleration(const PoseCurve& curve);

// Which observations are used, by frame and observation as in the data.
using PatternMask = std::vector<std::vector<char>>;

enum class AdjustmentEnd {
  kConverged,
  kOutOfSteps,  // usable, but not at the minimum
  kFailed,      // no usable solution
};

// *state: in, the start, at which all used observations have a projection; out, the solution; after
// kFailed not to be used.
[[nodiscard]] AdjustmentEnd adjust_pattern(const PatternData& data, const PatternMask& used,
                                           const LensKnowledge& knowledge,
                                           const PatternAdjustmentOptions& options,
                                           PatternState* state);

struct LensCovariance {
  // For independent errors of the detections with options.sigma_px.
  LensMatrix independent = LensMatrix::Zero();
  // Factor of each sigma, 1 or more: how much harder intervals of time, parts of the image and
  // single points pull than independent errors would.
  LensVector growth = LensVector::Ones();

  [[nodiscard]] LensMatrix covariance() const {
    return growth.asDiagonal() * independent * growth.asDiagonal();
  }
};

// At the state, with the curve free. Empty if a parameter that is not fixed is undetermined, or if
// a used observation has no projection.
[[nodiscard]] std::optional<LensCovariance> lens_covariance(const PatternData& data,
                                                            const PatternMask& used,
                                                            const LensKnowledge& knowledge,
                                                            const PatternAdjustmentOptions& options,
                                                            const PatternState& state);

}  // namespace alidade::internal
