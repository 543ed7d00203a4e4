#pragma once
// find_pose(): where a picture looks, and with which f, from matches of its features with
// directions of the map. Unknowns: R_base_from_camera at the reference row, and log f. If the mount
// is known, only pan and tilt turn the camera (mechanics.h), else the rotation is free. The motion
// during the read-out (map_projection.h) is known, or is estimated with a prior: the picture shows
// it, as its rows are exposed one after another.
// The covariance grows if residuals exceed their sigmas. Refuses what could be wrong, see
// PoseStatus. Equal input gives equal results. Allocates; no shared state. Method:
// docs/derivations.md.

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/mapping/lens_curve.h"
#include "core/mapping/picture_motion.h"
#include "core/model/angle.h"
#include "core/model/mechanics.h"

namespace alidade {

struct PoseMatch {
  Vector2<double> u;                                // px
  double sigma_px = 0.2;                            // of each coordinate of u; > 0
  Vector3<double> d_b;                              // unit direction of the landmark, base
  Matrix2<double> cov_d = Matrix2<double>::Zero();  // in tangent_basis(d_b), rad^2
};

struct FocalLengthPrior {
  double log_f = 0;  // f in px
  double sigma = 0;  // > 0
};

// Uncertainty of a motion: sigmas of the change during the read-out of all rows. 0: known.
// Infinity: unknown; the motion is then limited to some image widths a second, which is faster than
// heads turn.
struct MotionDoubt {
  double turn = 0;   // rad, of each of the mount's axes
  double log_f = 0;  // of log f's change
};
inline constexpr MotionDoubt kUnknownMotion{std::numeric_limits<double>::infinity(),
                                            std::numeric_limits<double>::infinity()};

// Prior knowledge of the picture.
struct PoseKnowledge {
  LensCurve lens;        // with segments and an image size
  PictureMotion motion;  // the mean; with a line delay of 0 a camera at rest
  MotionDoubt motion_doubt;
  std::optional<PictureMotion> motion_start;  // start of the search, as PicturePose::motion
  // A mount that turns the camera during the read-out. Empty: `mechanics`, or any axis.
  std::optional<Mechanics<double>> turned_by;
  std::optional<Mechanics<double>> mechanics;  // empty: the rotation is free
  std::optional<FocalLengthPrior> focal_length;
  double least_log_f = 0;  // range of log f (px)
  double most_log_f = 20;
};

struct PoseOptions {
  int max_trials = 2000;    // number of pairs of matches that are tried
  double threshold_px = 3;  // of an inlier of a pose from two matches
  // Gate of an inlier of the adjusted pose, in its sigmas times the noise that was found.
  double gate_sigmas = 4;
  double roll_tolerance = 0.05;  // rad; error of the mount's roll due to the noise of two matches
  int least_inliers = 8;         // less than 2 counts as 2
  double least_spread = 0.03;  // rms of the inliers along their narrow side, over the image's width
  // Limit of log10 of the expected number of poses with as many inliers by chance.
  double most_chance_log10 = -6;
  // Another pose is a rival if it has this share of the pose's number of inliers, among the matches
  // that are not inliers of the pose.
  double rival_share = 0.5;
  std::uint64_t seed = 1;
};

enum class PoseStatus {
  kOk,
  kTooFewMatches,  // fewer than least_inliers have usable numbers
  kNoPose,         // no pose has least_inliers
  kByChance,       // chance makes as many matches agree, see most_chance_log10
  kOneSpot,        // the inliers lie in one spot
  kCollinear,      // the inliers lie nearly on one line
  kRival,          // repeated texture: another pose explains nearly as much
  kNotDetermined,  // the adjustment has no minimum
  kTooFast,        // the estimated motion is faster than heads turn and than the model holds
};

[[nodiscard]] const char* to_string(PoseStatus status);

// Other members than status and the counts only with kOk.
struct PicturePose {
  PoseStatus status = PoseStatus::kTooFewMatches;
  Matrix3<double> R_base_from_camera = Matrix3<double>::Identity();
  double log_f = 0;
  // Covariance of xi in R Exp(xi) (camera frame, rad) and log f.
  Matrix4<double> covariance = Matrix4<double>::Zero();
  Camera<double> camera;                 // of log_f
  std::optional<PanTilt<double>> angle;  // true angles, rad; with a mount
  // The known motion; if it was estimated, in heights (picture_motion.h).
  PictureMotion motion;
  // Covariance of w and zoom rate of `motion`; 0 if the motion was known.
  Matrix4<double> motion_covariance = Matrix4<double>::Zero();
  std::vector<int> inliers;  // indices of matches, increasing
  double noise_scale = 0;    // rms of the residuals in their sigmas
  double chance_log10 = 0;   // see most_chance_log10
  int trials = 0;            // pairs of matches that were tried
};

// px; one sigma of the shift of the first or last row's pixels by the uncertain motion. log_f: of
// the picture.
[[nodiscard]] double motion_reach_px(const PoseKnowledge& knowledge, double log_f);

[[nodiscard]] PicturePose find_pose(const std::vector<PoseMatch>& matches,
                                    const PoseKnowledge& knowledge,
                                    const PoseOptions& options = {});

}  // namespace alidade
