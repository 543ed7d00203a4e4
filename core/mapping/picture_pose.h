#pragma once
// Where a picture looks, and with which focal length, from matches of its features with directions of the map.
//   unknown     R_base_from_camera when the reference row is exposed, log f; with a mount pan and tilt alone turn (mechanics.h),
//               without one the rotation is free
//   two matches give a rotation and f: f such that both rays enclose the angle that the directions do, then the rotation that takes
//               the one pair to the other (Lisanti et al. fit a homography's eight numbers instead). With a mount the roll that comes
//               out has to be the mount's. Best of many random twos: MSAC (Torr, Zisserman 2000)
//   then least squares over all inliers (Huber), each weighted by its own and its landmark's covariance, with f's prior; covariance
//               inflated where residuals are larger than claimed
//   motion      what the camera does while the picture is read out (map_projection.h) is known, or is adjusted, too, about what is
//               thought of it: rows that are exposed one after another tell it. The pose holds for the reference row
// Refused is what could be wrong, see PoseStatus. Equal input gives equal results. Allocates; no shared state.

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "core/mapping/lens_curve.h"
#include "core/mapping/map_projection.h"
#include "core/model/angle.h"
#include "core/model/mechanics.h"

namespace alidade {

struct PoseMatch {
  Vector2<double> u;                                // px
  double sigma_px = 0.2;                            // of each coordinate of u; above 0
  Vector3<double> d_b;                              // unit direction of the landmark, base
  Matrix2<double> cov_d = Matrix2<double>::Zero();  // in tangent_basis(d_b), rad^2
};

struct FocalLengthPrior {
  double log_f = 0;
  double sigma = 0;  // above 0
};

// What is not known of a motion: sigmas of what it does over the image's height. 0: it is as told. Infinity: nothing is known, but that no
// camera moves further than some widths of the image a second.
struct MotionDoubt {
  double turn = 0;   // rad, of each of the mount's axes
  double log_f = 0;  // of the change of log f
};
inline constexpr MotionDoubt kUnknownMotion{std::numeric_limits<double>::infinity(),
                                            std::numeric_limits<double>::infinity()};

// What is known of the picture beforehand.
struct PoseKnowledge {
  LensCurve lens;
  PictureMotion motion;  // with a line delay of 0 it tells nothing: the mean is a camera at rest
  MotionDoubt motion_doubt;
  std::optional<PictureMotion> motion_start;  // where the search begins, as PicturePose has it
  std::optional<Mechanics<double>>
      turned_by;  // a mount whose axes turn the picture meanwhile; none: mechanics, or any axis
  std::optional<Mechanics<double>> mechanics;  // none: the rotation is free
  std::optional<FocalLengthPrior> focal_length;
  double least_log_f = 0;  // the range that f is sought in
  double most_log_f = 20;
};

struct PoseOptions {
  int max_trials = 2000;    // twos of matches
  double threshold_px = 3;  // a match further off is no inlier of two matches' pose
  double gate_sigmas =
      4;  // nor of the adjusted one, in its own sigmas times the noise that was found
  double roll_tolerance = 0.05;  // rad: what two matches' noise makes of the mount's roll
  int least_inliers = 8;
  double least_spread = 0.03;  // rms of the inliers along their narrow side, of the image's width
  double most_chance_log10 =
      -6;  // of as many inliers among matches by chance, times the poses tried
  double rival_share =
      0.5;  // another pose with so many of the inliers, among the rest: which one is right?
  std::uint64_t seed = 1;
};

enum class PoseStatus {
  kOk,
  kTooFewMatches,  // less than least_inliers
  kNoPose,         // no two matches give a pose that least_inliers agree with
  kByChance,       // as many would agree by chance
  kOneSpot,        // the inliers lie in one spot
  kCollinear,      // or about one line
  kRival,          // repeated texture: another pose explains nearly as much
  kNotDetermined,  // the adjustment has no minimum
  kTooFast,  // the motion that was found is beyond what a head does, and beyond what is modelled
};

[[nodiscard]] const char* to_string(PoseStatus status);

// All but status and the counts only with kOk.
struct PicturePose {
  PoseStatus status = PoseStatus::kTooFewMatches;
  Matrix3<double> R_base_from_camera = Matrix3<double>::Identity();
  double log_f = 0;
  Matrix4<double> covariance =
      Matrix4<double>::Zero();           // of xi in R Exp(xi) (camera frame, rad), log f
  Camera<double> camera;                 // of log_f
  std::optional<PanTilt<double>> angle;  // true angles, with a mount
  PictureMotion motion;  // as known; found with what was doubted: in heights (map_projection.h)
  Matrix4<double> motion_covariance =
      Matrix4<double>::Zero();  // of its w and zoom rate; 0 where it was known
  std::vector<int> inliers;     // of the matches, increasing
  double noise_scale = 0;       // root mean square of the residuals in their sigmas
  double chance_log10 = 0;      // see most_chance_log10
  int trials = 0;
};

// How far off the motion's mean what is not known of it may put a pixel of the first or last row, px: one sigma.
[[nodiscard]] double motion_reach_px(const PoseKnowledge& knowledge, double log_f);

[[nodiscard]] PicturePose find_pose(const std::vector<PoseMatch>& matches,
                                    const PoseKnowledge& knowledge,
                                    const PoseOptions& options = {});

}  // namespace alidade
