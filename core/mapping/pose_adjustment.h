#pragma once
// Least squares of one picture's pose over matches that are thought to be right, for picture_pose.cpp alone.
//   adjusted   R and log f (pan, tilt, log f of a mount) and, where it is not known, what the camera does while the picture is read out:
//              its turn w and the change of log f over the image's height
//   prior      of w: the mount's axes turn at rates of so many rad; what else it could be is a fiftieth of that. Without a mount each
//              axis by itself
// Knowledge is in heights (in_heights()) where the motion is adjusted. Allocates; no shared state.

#include <optional>
#include <vector>

#include "core/mapping/picture_pose.h"

namespace alidade::internal {

struct PoseState {
  Matrix3<double> R = Matrix3<double>::Identity();
  PanTilt<double> angle;  // with a mount
  double log_f = 0;
  PictureMotion motion;
};

struct PoseFit {
  Matrix4<double> covariance;         // of xi, log f
  Matrix4<double> motion_covariance;  // of w, change of log f; 0 if known
  double noise_scale = 0;
};

[[nodiscard]] bool has_unknown_motion(const PoseKnowledge& knowledge);

// While the picture was read out, the camera did what no head does: nothing was checked there.
[[nodiscard]] bool moves_too_far(const PoseKnowledge& knowledge, const PoseState& state);

// Levenberg-Marquardt, errors by Huber in sigmas times `noise`; false: no minimum.
[[nodiscard]] bool adjust_pose(const std::vector<PoseMatch>& matches,
                               const std::vector<int>& inliers, const PoseKnowledge& knowledge,
                               double noise, int max_steps, PoseState* state);

// How much larger the residuals are than claimed, 1 at least.
[[nodiscard]] double noise_of(const std::vector<PoseMatch>& matches,
                              const std::vector<int>& inliers, const PoseKnowledge& knowledge,
                              const PoseState& state);

[[nodiscard]] std::vector<int> within_gate(const std::vector<PoseMatch>& matches,
                                           const std::vector<int>& candidates,
                                           const PoseKnowledge& knowledge, const PoseState& state,
                                           double gate_sigmas);

// None: the matches do not determine it.
[[nodiscard]] std::optional<PoseFit> fit_of(const std::vector<PoseMatch>& matches,
                                            const std::vector<int>& inliers,
                                            const PoseKnowledge& knowledge, const PoseState& state,
                                            double noise);

}  // namespace alidade::internal
