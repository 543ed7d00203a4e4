#include "core/mapping/picture_pose.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <random>

#include "core/mapping/map_projection.h"
#include "core/mapping/pose_adjustment.h"
#include "core/mapping/two_point_pose.h"
#include "core/model/nearest_angles.h"

namespace alidade {
namespace {

using internal::adjust_pose;
using internal::has_unknown_motion;
using internal::moves_too_far;
using internal::PoseState;
using internal::two_point_pose;
using internal::TwoPointPose;

constexpr int kMostSteps = 30;      // of an adjustment
constexpr int kMostFirstSteps = 5;  // of one that looks for more inliers
constexpr double kFirstNoise = 10;  // sigmas that a pose of two matches may be off
constexpr int kMostGrowths = 3;     // of the inliers of a pose of two matches, with a motion
constexpr std::size_t kLeastGrown = 6;

// Probability that no pair of inliers was drawn, at which drawing ends.
constexpr double kSureEnough = 1e-6;

// MSAC cost of a pose, px^2, and its inliers if asked for.
double cost_of(const std::vector<PoseMatch>& matches, const std::vector<int>& candidates,
               const LensCurve& lens, const PoseState& pose, double threshold_px, double give_up_at,
               std::vector<int>* inliers) {
  const Camera<double> camera = lens.camera_of(pose.log_f);
  const double most = threshold_px * threshold_px;
  double cost = 0;
  Vector2<double> seen;
  for (const int i : candidates) {
    const PoseMatch& match = matches[static_cast<std::size_t>(i)];
    double square = most;
    if (pixel_from_map(camera, pose.motion, pose.R, match.u.y(), match.d_b, &seen) ==
        ProjectionStatus::kOk) {
      square = std::min(most, (seen - match.u).squaredNorm());
    }
    cost += square;
    if (inliers != nullptr && square < most) inliers->push_back(i);
    if (cost > give_up_at) break;
  }
  return cost;
}

struct Consensus {
  PoseState pose;
  std::vector<int> inliers;  // empty: none
  int trials = 0;
};

bool agrees_with_knowledge(const TwoPointPose& pose, const PoseKnowledge& knowledge,
                           const PoseOptions& options) {
  // A motion that is ignored turns or stretches the pose of two matches by as much as it shears the
  // image.
  const double sheared =
      2 * motion_reach_px(knowledge, pose.log_f) / (0.5 * knowledge.lens.height());
  if (knowledge.focal_length) {
    // The noise of two matches adds to the prior's.
    const FocalLengthPrior& prior = *knowledge.focal_length;
    if (std::abs(pose.log_f - prior.log_f) > 4 * prior.sigma + 0.02 + sheared) return false;
  }
  if (!knowledge.mechanics) return true;
  return nearest_angles(*knowledge.mechanics, pose.R_base_from_camera).off <
         options.roll_tolerance + sheared;
}

// The state of a pose of two matches: with the start motion, and angles if there is a mount.
PoseState state_of(const TwoPointPose& pose, const PoseKnowledge& knowledge) {
  PoseState out{pose.R_base_from_camera, {}, pose.log_f, knowledge.motion};
  if (knowledge.mechanics) {
    out.angle = nearest_angles(*knowledge.mechanics, out.R).angle;
    out.R = R_base_from_camera(*knowledge.mechanics, out.angle);
  }
  return out;
}

Consensus best_pose(const std::vector<PoseMatch>& matches, const std::vector<int>& candidates,
                    const PoseKnowledge& knowledge, const PictureMotion& motion_start,
                    const PoseOptions& options, std::mt19937_64* random) {
  Consensus best;
  if (candidates.size() < 2) return best;
  const bool moves = has_unknown_motion(knowledge);
  std::uniform_int_distribution<std::size_t> draw(0, candidates.size() - 1);
  double least = std::numeric_limits<double>::infinity();
  int needed = options.max_trials;
  std::vector<int> inliers;
  PoseKnowledge begun = knowledge;
  begun.motion = motion_start;
  const auto cost_and_inliers = [&](const PoseState& pose) {
    inliers.clear();
    return cost_of(matches, candidates, knowledge.lens, pose, options.threshold_px, least,
                   &inliers);
  };
  for (; best.trials < needed; ++best.trials) {
    const std::size_t first = draw(*random);
    const std::size_t second = draw(*random);
    if (first == second) continue;
    const PoseMatch& a = matches[static_cast<std::size_t>(candidates[first])];
    const PoseMatch& b = matches[static_cast<std::size_t>(candidates[second])];
    const auto pose = two_point_pose(a, b, begun);
    if (!pose || !agrees_with_knowledge(*pose, begun, options)) continue;
    PoseState state{pose->R_base_from_camera, {}, pose->log_f, begun.motion};
    double cost = cost_and_inliers(state);
    if (!(cost < least)) continue;
    least = cost;
    best.pose = state;
    best.inliers = inliers;
    // Two matches do not determine a motion. All matches near the pose do, and with the motion more
    // of them fit (Chum, Matas, Kittler 2003).
    if (moves) state = state_of(*pose, begun);
    for (int step = 0; moves && step < kMostGrowths; ++step) {
      if (best.inliers.size() < kLeastGrown ||
          !adjust_pose(matches, best.inliers, knowledge, kFirstNoise, kMostFirstSteps, &state)) {
        break;
      }
      cost = cost_and_inliers(state);
      if (!(cost < least)) break;
      least = cost;
      best.pose = state;
      best.inliers = inliers;
      begun.motion = state.motion;
    }
    // Only pairs that are far apart determine a pose; half of the inlier pairs are too close.
    const double share =
        static_cast<double>(best.inliers.size()) / static_cast<double>(candidates.size());
    const double good = std::clamp(0.5 * share * share, 1e-9, 1 - 1e-9);
    needed = static_cast<int>(std::min<double>(
        options.max_trials,
        std::max<double>(best.trials + 1, std::ceil(std::log(kSureEnough) / std::log1p(-good)))));
  }
  return best;
}

// log10 of the expected number of poses with so many inliers if all matches were wrong and anywhere
// (Moisan, Stival 2004). A pose takes two matches, with a motion four.
double chance_log10(std::size_t matches, std::size_t inliers, double radius_px,
                    const PoseKnowledge& knowledge) {
  const double n = static_cast<double>(matches);
  const double k = static_cast<double>(inliers);
  const double p =
      std::min(1.0, kPi * radius_px * radius_px /
                        (knowledge.lens.width() * static_cast<double>(knowledge.lens.height())));
  const double drawn = has_unknown_motion(knowledge) ? 4 : 2;
  const double log_choices = std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1);
  return (log_choices + (k - drawn) * std::log(p) + drawn * std::log(n)) / std::log(10.0);
}

PoseStatus layout_status(const std::vector<PoseMatch>& matches, const std::vector<int>& inliers,
                         const PoseKnowledge& knowledge, const PoseOptions& options) {
  Vector2<double> mean = Vector2<double>::Zero();
  for (const int i : inliers) mean += matches[static_cast<std::size_t>(i)].u;
  mean /= static_cast<double>(inliers.size());
  Matrix2<double> scatter = Matrix2<double>::Zero();
  for (const int i : inliers) {
    const Vector2<double> off = matches[static_cast<std::size_t>(i)].u - mean;
    scatter += off * off.transpose() / static_cast<double>(inliers.size());
  }
  const Vector2<double> along =
      Eigen::SelfAdjointEigenSolver<Matrix2<double>>(scatter).eigenvalues().cwiseMax(0).cwiseSqrt();
  const double least = options.least_spread * knowledge.lens.width();
  if (along[1] < least) return PoseStatus::kOneSpot;
  return along[0] < least ? PoseStatus::kCollinear : PoseStatus::kOk;
}

std::vector<int> without(const std::vector<int>& all, const std::vector<int>& some) {
  std::vector<int> out;
  std::set_difference(all.begin(), all.end(), some.begin(), some.end(), std::back_inserter(out));
  return out;
}

// Indices of matches with usable numbers.
std::vector<int> usable(const std::vector<PoseMatch>& matches) {
  std::vector<int> out;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    const PoseMatch& match = matches[i];
    if (all_finite(match.u) && all_finite(match.d_b) && all_finite(match.cov_d) &&
        match.sigma_px > 0 && std::abs(match.d_b.norm() - 1) < 1e-6) {
      out.push_back(static_cast<int>(i));
    }
  }
  return out;
}

}  // namespace

const char* to_string(PoseStatus status) {
  switch (status) {
    case PoseStatus::kOk:
      return "ok";
    case PoseStatus::kTooFewMatches:
      return "too few matches";
    case PoseStatus::kNoPose:
      return "no pose fits enough matches";
    case PoseStatus::kByChance:
      return "as many matches would agree by chance";
    case PoseStatus::kOneSpot:
      return "the matches lie in one spot of the image";
    case PoseStatus::kCollinear:
      return "the matches lie near one line";
    case PoseStatus::kRival:
      return "another pose explains nearly as many matches";
    case PoseStatus::kNotDetermined:
      return "the matches do not determine the pose";
    case PoseStatus::kTooFast:
      return "the camera moved too far while the picture was read out";
  }
  return "unknown status";
}

PicturePose find_pose(const std::vector<PoseMatch>& matches, const PoseKnowledge& told,
                      const PoseOptions& options) {
  PicturePose out;
  const std::vector<int> candidates = usable(matches);
  const auto least_inliers = static_cast<std::size_t>(std::max(2, options.least_inliers));
  if (candidates.size() < least_inliers) return out;
  PoseKnowledge knowledge = told;
  if (has_unknown_motion(told)) knowledge.motion = in_heights(told.motion, told.lens.height());
  std::mt19937_64 random(options.seed);
  const Consensus best = best_pose(matches, candidates, knowledge,
                                   told.motion_start.value_or(knowledge.motion), options, &random);
  out.trials = best.trials;
  out.status = PoseStatus::kNoPose;
  if (best.inliers.size() < least_inliers) return out;

  PoseState state = best.pose;
  if (knowledge.mechanics) {
    state.angle = nearest_angles(*knowledge.mechanics, state.R).angle;
    state.R = R_base_from_camera(*knowledge.mechanics, state.angle);
  }
  out.inliers = best.inliers;
  double noise = 1;
  // The pose of two matches misses some inliers that the adjusted one finds.
  for (const double gate : {4 * options.gate_sigmas, 1.5 * options.gate_sigmas, options.gate_sigmas,
                            options.gate_sigmas}) {
    if (!adjust_pose(matches, out.inliers, knowledge, noise, kMostSteps, &state)) {
      out.status = PoseStatus::kNotDetermined;
      return out;
    }
    noise = internal::noise_of(matches, out.inliers, knowledge, state);
    out.inliers = internal::within_gate(matches, candidates, knowledge, state, gate * noise);
    if (out.inliers.size() < least_inliers) return out;
  }
  out.chance_log10 =
      chance_log10(candidates.size(), out.inliers.size(), options.threshold_px, knowledge);
  out.status = PoseStatus::kByChance;
  if (out.chance_log10 > options.most_chance_log10) return out;
  out.status = layout_status(matches, out.inliers, knowledge, options);
  if (out.status != PoseStatus::kOk) return out;

  const std::vector<int> rest = without(candidates, out.inliers);
  const Consensus rival = best_pose(matches, rest, knowledge, state.motion, options, &random);
  out.trials += rival.trials;
  if (rival.inliers.size() >= least_inliers &&
      static_cast<double>(rival.inliers.size()) >=
          options.rival_share * static_cast<double>(out.inliers.size()) &&
      chance_log10(rest.size(), rival.inliers.size(), options.threshold_px, knowledge) <
          options.most_chance_log10) {
    out.status = PoseStatus::kRival;
    return out;
  }
  const auto fit = internal::fit_of(matches, out.inliers, knowledge, state, noise);
  if (!fit) {
    out.status = PoseStatus::kNotDetermined;
    return out;
  }
  if (has_unknown_motion(told) && moves_too_far(knowledge, state)) {
    out.status = PoseStatus::kTooFast;
    return out;
  }
  out.covariance = fit->covariance;
  out.motion_covariance = fit->motion_covariance;
  out.noise_scale = fit->noise_scale;
  out.R_base_from_camera = state.R;
  out.log_f = state.log_f;
  out.motion = state.motion;
  out.camera = knowledge.lens.camera_of(state.log_f);
  if (knowledge.mechanics) out.angle = state.angle;
  return out;
}

}  // namespace alidade
