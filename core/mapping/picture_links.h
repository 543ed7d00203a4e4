#pragma once
// Pairs of pictures: which are worth comparing, their matches, and whether a rotation and a change
// of f explain the matches. Two pictures are compared if they see the same place by telemetry and
// zoom; without telemetry, if retrieval over all features suggests it. A link is checked as the
// pose of one picture in the other's frame (picture_pose.h). The lens need not be known yet: the
// threshold allows for its distortion. Batch work: allocates. Pure.

#include <optional>
#include <utility>
#include <vector>

#include "core/mapping/feature_matching.h"
#include "core/mapping/features.h"
#include "core/mapping/lens_curve.h"
#include "core/mapping/picture_motion.h"
#include "core/mapping/picture_pose.h"

namespace alidade {

struct LinkedPicture {
  FeatureSet features;
  PictureMotion motion;
  double log_f = 0;  // f in px
  double log_f_sigma = 0.05;
  std::optional<Matrix3<double>> R_base_from_camera;  // from telemetry
  double R_sigma = 0;                                 // rad
};

struct LinkOptions {
  double ratio = 0.8;              // as MatchOptions::ratio
  int most_partners = 12;          // that each picture asks for; others may ask for it, too
  double most_log_f_off = 1.2;     // of two pictures; beyond, few features have a size seen in both
  double threshold_share = 0.008;  // of the image's width; how far distortion may move a match
  int least_inliers = 12;          // of a link
};

// Indices (a, b), a < b, in increasing order. width, height: px.
[[nodiscard]] std::vector<std::pair<int, int>> pairs_to_compare(
    const std::vector<LinkedPicture>& pictures, int width, int height, const LinkOptions& options);

struct PictureLink {
  int a = 0;
  int b = 0;
  std::vector<FeatureMatch> matches;  // query: feature of b; indexed: of a
  // Set by check_link(): find_pose()'s status; or kTooFewMatches with fewer than least_inliers,
  // kRival if telemetry contradicts the pose.
  PoseStatus status = PoseStatus::kTooFewMatches;
  // The next two are set with kOk only.
  std::vector<int> inliers;  // of matches
  Matrix3<double> R_a_from_b = Matrix3<double>::Identity();
};

// The link's matches, not yet checked.
[[nodiscard]] PictureLink match_pair(const std::vector<LinkedPicture>& pictures, int a, int b,
                                     const LinkOptions& options);

// Sets status, inliers and R_a_from_b of a link with matches. lens: gives distortion and centre.
void check_link(const std::vector<LinkedPicture>& pictures, const LensCurve& lens,
                const LinkOptions& options, PictureLink* link);

// The common focal length (log f, f in px) with which the matches of these links fit best, for
// pictures of one lens that did not zoom. Only the eight links with most matches are tried. Empty
// if none of them fits with 0.4 to 12 image widths.
[[nodiscard]] std::optional<double> common_focal_length(const std::vector<LinkedPicture>& pictures,
                                                        const std::vector<PictureLink>& links,
                                                        int width, int height,
                                                        const LinkOptions& options);

// Start values of R_base_from_camera, by picture: from telemetry, and from there along the
// strongest links. If no picture has telemetry, the picture whose links have most inliers looks
// forward and is the beginning. Empty for pictures that are not connected to a beginning.
[[nodiscard]] std::vector<std::optional<Matrix3<double>>> start_orientations(
    const std::vector<LinkedPicture>& pictures, const std::vector<PictureLink>& links);

}  // namespace alidade
