#include "core/mapping/picture_pose.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <random>

#include "core/mapping/two_point_pose.h"
#include "core/model/nearest_angles.h"

namespace alidade {
namespace {

using internal::two_point_pose;
using internal::TwoPointPose;

constexpr double kHuber_sigmas = 2.5;
constexpr double kSureEnough =
    1e-6;  // probability that no two inliers have been drawn, at which drawing ends

// Pose and lens as they are adjusted.
struct PoseState {
  Matrix3<double> R;
  PanTilt<double> angle;
  double log_f = 0;
};

struct Residual {
  Vector2<double> error;        // px, seen less predicted
  Matrix<double, 2, 4> J;       // of the prediction, by xi and log f
  Matrix2<double> information;  // 1/px^2
  double square = 0;            // of the error in its sigmas
};

bool residual_of(const PoseMatch& match, const PoseKnowledge& knowledge, const PoseState& state,
                 const Camera<double>& camera,
                 const Matrix<double, kCameraParameterCount, 1>& J_camera_log, Residual* out) {
  MapProjection seen;
  if (project_from_map(camera, knowledge.motion, state.R, match.u.y(), match.d_b, &seen) !=
      ProjectionStatus::kOk) {
    return false;
  }
  out->error = match.u - seen.u;
  out->J << seen.J_u_xi, seen.J_u_camera * J_camera_log;
  const Matrix<double, 2, 2> J_u_tangent = seen.J_u_d * tangent_basis(match.d_b);
  const Matrix2<double> of_pixel = reprojection_error_covariance<double>(
      seen.J_u_row, match.sigma_px * match.sigma_px * Matrix2<double>::Identity());
  const Matrix2<double> covariance = of_pixel + J_u_tangent * match.cov_d * J_u_tangent.transpose();
  out->information = covariance.inverse();
  out->square = out->error.dot(out->information * out->error);
  return std::isfinite(out->square);
}

// MSAC's cost of a pose, px^2; the matches within the threshold where asked for.
double cost_of(const std::vector<PoseMatch>& matches, const std::vector<int>& candidates,
               const PoseKnowledge& knowledge, const TwoPointPose& pose, double threshold_px,
               double give_up_at, std::vector<int>* inliers) {
  const Camera<double> camera = knowledge.lens.camera_of(pose.log_f);
  const double most = threshold_px * threshold_px;
  double cost = 0;
  MapProjection seen;
  for (const int i : candidates) {
    const PoseMatch& match = matches[static_cast<std::size_t>(i)];
    double square = most;
    if (project_from_map(camera, knowledge.motion, pose.R_base_from_camera, match.u.y(), match.d_b,
                         &seen) == ProjectionStatus::kOk) {
      square = std::min(most, (seen.u - match.u).squaredNorm());
    }
    cost += square;
    if (inliers != nullptr && square < most) inliers->push_back(i);
    if (cost > give_up_at) break;
  }
  return cost;
}

struct Consensus {
  TwoPointPose pose;
  std::vector<int> inliers;  // empty: none
  int trials = 0;
};

bool agrees_with_knowledge(const TwoPointPose& pose, const PoseKnowledge& knowledge,
                           const PoseOptions& options) {
  if (knowledge.focal_length) {
    // Two matches' own noise on top of the prior's.
    const FocalLengthPrior& prior = *knowledge.focal_length;
    if (std::abs(pose.log_f - prior.log_f) > 4 * prior.sigma + 0.02) return false;
  }
  if (!knowledge.mechanics) return true;
  return nearest_angles(*knowledge.mechanics, pose.R_base_from_camera).off < options.roll_tolerance;
}

Consensus best_pose(const std::vector<PoseMatch>& matches, const std::vector<int>& candidates,
                    const PoseKnowledge& knowledge, const PoseOptions& options,
                    std::mt19937_64* random) {
  Consensus best;
  if (candidates.size() < 2) return best;
  std::uniform_int_distribution<std::size_t> draw(0, candidates.size() - 1);
  double least = std::numeric_limits<double>::infinity();
  int needed = options.max_trials;
  std::vector<int> inliers;
  for (; best.trials < needed; ++best.trials) {
    const std::size_t first = draw(*random);
    const std::size_t second = draw(*random);
    if (first == second) continue;
    const PoseMatch& a = matches[static_cast<std::size_t>(candidates[first])];
    const PoseMatch& b = matches[static_cast<std::size_t>(candidates[second])];
    const auto pose = two_point_pose(a, b, knowledge);
    if (!pose || !agrees_with_knowledge(*pose, knowledge, options)) continue;
    inliers.clear();
    const double cost =
        cost_of(matches, candidates, knowledge, *pose, options.threshold_px, least, &inliers);
    if (!(cost < least)) continue;
    least = cost;
    best.pose = *pose;
    best.inliers = inliers;
    // Far-apart twos are needed: half of the good ones lie too near to each other to tell.
    const double share =
        static_cast<double>(inliers.size()) / static_cast<double>(candidates.size());
    const double good = std::clamp(0.5 * share * share, 1e-9, 1 - 1e-9);
    needed = static_cast<int>(std::min<double>(
        options.max_trials,
        std::max<double>(best.trials + 1, std::ceil(std::log(kSureEnough) / std::log1p(-good)))));
  }
  return best;
}

// log10 of how many poses with as many inliers the twos of matches would give, if all matches were wrong and anywhere
// (Moisan, Stival 2004).
double chance_log10(std::size_t matches, std::size_t inliers, double radius_px,
                    const LensCurve& lens) {
  const double n = static_cast<double>(matches);
  const double k = static_cast<double>(inliers);
  const double p = std::min(
      1.0, 3.14159 * radius_px * radius_px / (lens.width() * static_cast<double>(lens.height())));
  const double log_choices = std::lgamma(n + 1) - std::lgamma(k + 1) - std::lgamma(n - k + 1);
  return (log_choices + (k - 2) * std::log(p) + 2 * std::log(n)) / std::log(10.0);
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

struct NormalEquations {
  Matrix4<double> N = Matrix4<double>::Zero();
  Vector4<double> b = Vector4<double>::Zero();
  double cost = 0;
  double sum_of_squares = 0;
  int used = 0;
};

NormalEquations normal_equations(const std::vector<PoseMatch>& matches,
                                 const std::vector<int>& inliers, const PoseKnowledge& knowledge,
                                 const PoseState& state, double noise) {
  NormalEquations out;
  Matrix<double, kCameraParameterCount, 1> J_camera_log;
  const Camera<double> camera = knowledge.lens.camera_of(state.log_f, &J_camera_log);
  Residual residual;
  for (const int i : inliers) {
    if (!residual_of(matches[static_cast<std::size_t>(i)], knowledge, state, camera, J_camera_log,
                     &residual)) {
      out.cost += 1e6;
      continue;
    }
    const double size = std::sqrt(residual.square);
    const double bend = kHuber_sigmas * noise;
    const double weight = size <= bend ? 1 : bend / size;
    out.cost += size <= bend ? residual.square : bend * (2 * size - bend);
    const Matrix<double, 4, 2> weighted = weight * residual.J.transpose() * residual.information;
    out.N += weighted * residual.J;
    out.b += weighted * residual.error;
    out.sum_of_squares += weight * residual.square;
    ++out.used;
  }
  if (knowledge.focal_length) {
    const FocalLengthPrior& prior = *knowledge.focal_length;
    const double information = 1 / (prior.sigma * prior.sigma);
    const double off = prior.log_f - state.log_f;
    out.N(3, 3) += information;
    out.b[3] += information * off;
    out.cost += information * off * off;
  }
  return out;
}

// How xi and log f follow from what is adjusted: pan, tilt, log f of a mount; else xi and log f themselves, of which the last column
// of four is used.
Eigen::Matrix<double, 4, Eigen::Dynamic, 0, 4, 4> directions_of_change(
    const PoseKnowledge& knowledge, const PoseState& state) {
  if (!knowledge.mechanics) return Matrix4<double>::Identity();
  Matrix<double, 3, 2> J;
  (void)R_base_from_camera(*knowledge.mechanics, state.angle, &J);
  Matrix<double, 4, 3> out = Matrix<double, 4, 3>::Zero();
  out.topLeftCorner<3, 2>() = J;
  out(3, 2) = 1;
  return out;
}

PoseState moved(const PoseKnowledge& knowledge, const PoseState& state,
                const Eigen::VectorXd& change) {
  PoseState out = state;
  out.log_f += change[change.size() - 1];
  if (knowledge.mechanics) {
    out.angle = plus(state.angle, Vector2<double>(change.head<2>()));
    out.R = R_base_from_camera(*knowledge.mechanics, out.angle);
  } else {
    out.R = state.R * exp_so3(Vector3<double>(change.head<3>()));
  }
  return out;
}

// Levenberg-Marquardt; false: no minimum.
bool adjust(const std::vector<PoseMatch>& matches, const std::vector<int>& inliers,
            const PoseKnowledge& knowledge, double noise, PoseState* state) {
  constexpr int kMaxSteps = 30;
  double damping = 1e-6;
  NormalEquations at = normal_equations(matches, inliers, knowledge, *state, noise);
  for (int step = 0; step < kMaxSteps; ++step) {
    const auto A = directions_of_change(knowledge, *state);
    Eigen::MatrixXd N = A.transpose() * at.N * A;
    const Eigen::VectorXd b = A.transpose() * at.b;
    N.diagonal() *= 1 + damping;
    const Eigen::VectorXd change = N.ldlt().solve(b);
    if (!change.allFinite() || change.norm() > 10) return false;
    const PoseState next = moved(knowledge, *state, change);
    const NormalEquations there = normal_equations(matches, inliers, knowledge, next, noise);
    const double gained = at.cost - there.cost;
    if (gained >= 0) {
      *state = next;
      at = there;
      damping = std::max(1e-9, damping / 10);
    } else {
      damping *= 10;
    }
    if (std::abs(gained) <= 1e-10 * (1 + at.cost)) return true;
    if (damping > 1e6) return true;
  }
  return true;
}

// How much larger the residuals are than claimed, 1 at least: by their median, which wrong ones hardly move. With a gate by the
// claim alone, what is left of larger noise would look calm.
double noise_of(const std::vector<PoseMatch>& matches, const std::vector<int>& inliers,
                const PoseKnowledge& knowledge, const PoseState& state) {
  Matrix<double, kCameraParameterCount, 1> J_camera_log;
  const Camera<double> camera = knowledge.lens.camera_of(state.log_f, &J_camera_log);
  std::vector<double> squares;
  Residual residual;
  for (const int i : inliers) {
    if (residual_of(matches[static_cast<std::size_t>(i)], knowledge, state, camera, J_camera_log,
                    &residual)) {
      squares.push_back(residual.square);
    }
  }
  if (squares.empty()) return 1;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  const double median_of_two = 2 * std::log(2.0);  // of chi-square with two degrees of freedom
  return std::max(1.0, std::sqrt(*middle / median_of_two));
}

std::vector<int> within_gate(const std::vector<PoseMatch>& matches,
                             const std::vector<int>& candidates, const PoseKnowledge& knowledge,
                             const PoseState& state, double gate_sigmas) {
  Matrix<double, kCameraParameterCount, 1> J_camera_log;
  const Camera<double> camera = knowledge.lens.camera_of(state.log_f, &J_camera_log);
  std::vector<int> out;
  Residual residual;
  for (const int i : candidates) {
    if (residual_of(matches[static_cast<std::size_t>(i)], knowledge, state, camera, J_camera_log,
                    &residual) &&
        residual.square < gate_sigmas * gate_sigmas) {
      out.push_back(i);
    }
  }
  return out;
}

std::vector<int> without(const std::vector<int>& all, const std::vector<int>& some) {
  std::vector<int> out;
  std::set_difference(all.begin(), all.end(), some.begin(), some.end(), std::back_inserter(out));
  return out;
}

// Those whose numbers can be used.
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

// Covariance of xi and log f; false if they are not determined.
bool covariance_of(const NormalEquations& at, const PoseKnowledge& knowledge,
                   const PoseState& state, PicturePose* out) {
  const auto A = directions_of_change(knowledge, state);
  const Eigen::MatrixXd N = A.transpose() * at.N * A;
  const Eigen::LLT<Eigen::MatrixXd> factors(N);
  if (factors.info() != Eigen::Success) return false;
  const auto unknowns = N.rows();
  const double freedom = std::max(1.0, 2.0 * at.used - static_cast<double>(unknowns));
  out->noise_scale = std::sqrt(at.sum_of_squares / freedom);
  const double inflation = std::max(1.0, at.sum_of_squares / freedom);
  out->covariance =
      inflation * A * factors.solve(Eigen::MatrixXd::Identity(unknowns, unknowns)) * A.transpose();
  return out->covariance.allFinite();
}

}  // namespace

const char* to_string(PoseStatus status) {
  switch (status) {
    case PoseStatus::kOk:
      return "ok";
    case PoseStatus::kTooFewMatches:
      return "too few matches";
    case PoseStatus::kNoPose:
      return "no pose that enough matches agree with";
    case PoseStatus::kByChance:
      return "as many matches would agree by chance";
    case PoseStatus::kOneSpot:
      return "the matches lie in one spot of the image";
    case PoseStatus::kCollinear:
      return "the matches lie about one line";
    case PoseStatus::kRival:
      return "another pose explains nearly as many matches";
    case PoseStatus::kNotDetermined:
      return "the matches do not determine the pose";
  }
  return "unknown status";
}

PicturePose find_pose(const std::vector<PoseMatch>& matches, const PoseKnowledge& knowledge,
                      const PoseOptions& options) {
  PicturePose out;
  const std::vector<int> candidates = usable(matches);
  const auto least_inliers = static_cast<std::size_t>(std::max(2, options.least_inliers));
  if (candidates.size() < least_inliers) return out;
  std::mt19937_64 random(options.seed);
  const Consensus best = best_pose(matches, candidates, knowledge, options, &random);
  out.trials = best.trials;
  out.status = PoseStatus::kNoPose;
  if (best.inliers.size() < least_inliers) return out;

  PoseState state{best.pose.R_base_from_camera, {}, best.pose.log_f};
  if (knowledge.mechanics) {
    state.angle = nearest_angles(*knowledge.mechanics, state.R).angle;
    state.R = R_base_from_camera(*knowledge.mechanics, state.angle);
  }
  out.inliers = best.inliers;
  double noise = 1;
  // Two matches' pose misses some that the adjusted one finds.
  for (const double gate : {4 * options.gate_sigmas, 1.5 * options.gate_sigmas, options.gate_sigmas,
                            options.gate_sigmas}) {
    if (!adjust(matches, out.inliers, knowledge, noise, &state)) {
      out.status = PoseStatus::kNotDetermined;
      return out;
    }
    noise = noise_of(matches, out.inliers, knowledge, state);
    out.inliers = within_gate(matches, candidates, knowledge, state, gate * noise);
    if (out.inliers.size() < least_inliers) return out;
  }
  out.chance_log10 =
      chance_log10(candidates.size(), out.inliers.size(), options.threshold_px, knowledge.lens);
  out.status = PoseStatus::kByChance;
  if (out.chance_log10 > options.most_chance_log10) return out;
  out.status = layout_status(matches, out.inliers, knowledge, options);
  if (out.status != PoseStatus::kOk) return out;

  const std::vector<int> rest = without(candidates, out.inliers);
  const Consensus rival = best_pose(matches, rest, knowledge, options, &random);
  out.trials += rival.trials;
  if (rival.inliers.size() >= least_inliers &&
      static_cast<double>(rival.inliers.size()) >=
          options.rival_share * static_cast<double>(out.inliers.size()) &&
      chance_log10(rest.size(), rival.inliers.size(), options.threshold_px, knowledge.lens) <
          options.most_chance_log10) {
    out.status = PoseStatus::kRival;
    return out;
  }
  const NormalEquations at = normal_equations(matches, out.inliers, knowledge, state, noise);
  if (!covariance_of(at, knowledge, state, &out)) {
    out.status = PoseStatus::kNotDetermined;
    return out;
  }
  out.R_base_from_camera = state.R;
  out.log_f = state.log_f;
  out.camera = knowledge.lens.camera_of(state.log_f);
  if (knowledge.mechanics) out.angle = state.angle;
  return out;
}

}  // namespace alidade
