#pragma once
// The joint adjustment of pose curve and lens (Oth 7, with theta the whole lens): all observations, a weak prior on the
// curve's accelerations (Oth, section 4.1), what is known of the lens before. By Ceres, with analytic Jacobians.

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
  double robust_scale = 0;      // Cauchy's, in sigmas; 0: squares
  double position_noise = 100;  // prior: power density of the accelerations, (m/s^2)^2 s
  double rotation_noise = 1e4;  // (rad/s^2)^2 s
  int max_steps = 30;
  // Of the trust region to begin with, in Ceres's units: small far from the solution, so that no step runs wild; large near it,
  // where it would only keep what the data hardly hold from getting there.
  double first_radius = 1e4;
  double relative_decrease = 1e-7;  // of the cost, at which it ends
};

// Over all of the curve, (m/s^2)^2 and (rad/s^2)^2.
[[nodiscard]] PoseVector mean_square_acceleration(const PoseCurve& curve);

// Which observations take part, frame by frame as in the data.
using PatternMask = std::vector<std::vector<char>>;

enum class AdjustmentEnd {
  kConverged,
  kOutOfSteps,  // usable, and not at the minimum
  kFailed,      // the solver found nothing that can be used
};

[[nodiscard]] AdjustmentEnd adjust_pattern(const PatternData& data, const PatternMask& used,
                                           const LensKnowledge& knowledge,
                                           const PatternAdjustmentOptions& options,
                                           PatternState* state);

struct LensCovariance {
  LensMatrix independent =
      LensMatrix::Zero();  // if detections err independently, by options.sigma_px
  // Of each sigma, 1 or more: what stretches of time, parts of the image and single points pull harder than independent errors would.
  LensVector growth = LensVector::Ones();

  [[nodiscard]] LensMatrix covariance() const {
    return growth.asDiagonal() * independent * growth.asDiagonal();
  }
};

// With the curve free, at the state. Empty if what is not fixed is not determined.
[[nodiscard]] std::optional<LensCovariance> lens_covariance(const PatternData& data,
                                                            const PatternMask& used,
                                                            const LensKnowledge& knowledge,
                                                            const PatternAdjustmentOptions& options,
                                                            const PatternState& state);

}  // namespace alidade::internal
