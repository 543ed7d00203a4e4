#pragma once
// Least squares of one picture's pose over presumed inliers, for picture_pose.cpp alone. Unknowns:
// R and log f (with a mount pan, tilt, log f); if the motion during the read-out is not known, also
// the turn w and the change of log f over the image's height.
// Prior of w: MotionDoubt's sigma about each of the mount's axes, a fiftieth of it about any other
// axis. Without a mount: MotionDoubt's sigma about each axis of the camera. If the motion is
// adjusted, `knowledge` is in heights (in_heights()). Allocates; no shared state.

#include <optional>
#include <vector>

#include "core/mapping/picture_pose.h"

namespace alidade::internal {

struct PoseState {
  Matrix3<double> R = Matrix3<double>::Identity();  // R_base_from_camera
  PanTilt<double> angle;                            // rad; with a mount
  double log_f = 0;                                 // f in px
  PictureMotion motion;
};

struct PoseFit {
  Matrix4<double> covariance;         // of xi (rad) and log f
  Matrix4<double> motion_covariance;  // of w and log f's change; 0 if the motion is known
  double noise_scale = 0;             // rms of the residuals in their sigmas
};

// Whether the motion must be adjusted.
[[nodiscard]] bool has_unknown_motion(const PoseKnowledge& knowledge);

// Whether the estimated motion during the read-out is faster than any head, for which the method
// was not checked.
[[nodiscard]] bool moves_too_far(const PoseKnowledge& knowledge, const PoseState& state);

// Levenberg-Marquardt with Huber's loss; its sigmas are those of the matches times `noise`.
// inliers: indices of matches, here and below. False: a step is not finite or runs away. True also
// if max_steps do not lead to the minimum.
[[nodiscard]] bool adjust_pose(const std::vector<PoseMatch>& matches,
                               const std::vector<int>& inliers, const PoseKnowledge& knowledge,
                               double noise, int max_steps, PoseState* state);

// How much larger the residuals are than their sigmas; at least 1.
[[nodiscard]] double noise_of(const std::vector<PoseMatch>& matches,
                              const std::vector<int>& inliers, const PoseKnowledge& knowledge,
                              const PoseState& state);

// The candidates (indices of matches) whose residuals lie within gate_sigmas.
[[nodiscard]] std::vector<int> within_gate(const std::vector<PoseMatch>& matches,
                                           const std::vector<int>& candidates,
                                           const PoseKnowledge& knowledge, const PoseState& state,
                                           double gate_sigmas);

// Empty if the matches do not determine the pose. noise: as noise_of() gives it.
[[nodiscard]] std::optional<PoseFit> fit_of(const std::vector<PoseMatch>& matches,
                                            const std::vector<int>& inliers,
                                            const PoseKnowledge& knowledge, const PoseState& state,
                                            double noise);

}  // namespace alidade::internal
