#include "core/mapping/pose_adjustment.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/mapping/map_projection.h"
#include "core/model/nearest_angles.h"
#include "core/model/rolling_shutter.h"

namespace alidade {
namespace internal {
namespace {

constexpr double kHuber_sigmas = 2.5;
// Bounds of an unknown motion over the image's height: sigma of a shift in image widths, of a turn
// about the optical axis (rad), of log f. They include a field of view a second and the fastest
// lenses, read out in 30 ms.
constexpr double kWidestShift = 0.05;
constexpr double kWidestRoll = 0.05;
constexpr double kWidestZoom = 0.03;
// Least sigmas of a known motion, in px and of log f: keep the numbers invertible.
constexpr double kLeastShift_px = 1e-3;
constexpr double kLeastZoom = 1e-6;
// Share of a motion that is not about the mount's known axes.
constexpr double kOffAxes = 0.02;

// Order: xi, log f, w, change of log f; the last four only if the motion is not known.
constexpr int kPoseCount = 4;
constexpr int kMostCount = 8;
using Unknowns = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostCount, 1>;
using Square = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostCount, kMostCount>;

int full_count(const PoseKnowledge& knowledge) {
  return has_unknown_motion(knowledge) ? kMostCount : kPoseCount;
}

struct Residual {
  Vector2<double> error;            // px, seen minus predicted
  Matrix<double, 2, kMostCount> J;  // of the prediction
  Matrix2<double> information;      // 1/px^2
  double square = 0;                // of the error in its sigmas
};

bool residual_of(const PoseMatch& match, const PoseState& state, const Camera<double>& camera,
                 const CameraColumn<double>& J_camera_log, Residual* out) {
  MapProjection seen;
  if (project_from_map(camera, state.motion, state.R, match.u.y(), match.d_b, &seen) !=
      ProjectionStatus::kOk) {
    return false;
  }
  out->error = match.u - seen.u;
  out->J << seen.J_u_xi, seen.J_u_camera * J_camera_log, seen.J_u_motion;
  const Matrix<double, 2, 2> J_u_tangent = seen.J_u_d * tangent_basis(match.d_b);
  const Matrix2<double> of_pixel = reprojection_error_covariance<double>(
      seen.J_u_row, match.sigma_px * match.sigma_px * Matrix2<double>::Identity());
  const Matrix2<double> covariance = of_pixel + J_u_tangent * match.cov_d * J_u_tangent.transpose();
  out->information = covariance.inverse();
  out->square = out->error.dot(out->information * out->error);
  return std::isfinite(out->square);
}

double turn_sigma(const PoseKnowledge& knowledge, double log_f) {
  const double px = 1 / std::exp(log_f);
  return std::clamp(knowledge.motion_doubt.turn, kLeastShift_px * px,
                    kWidestShift * knowledge.lens.width() * px);
}

double zoom_sigma(const PoseKnowledge& knowledge) {
  return std::clamp(knowledge.motion_doubt.log_f, kLeastZoom, kWidestZoom);
}

// Information of w and the change of log f about knowledge.motion.
Matrix4<double> motion_information(const PoseKnowledge& knowledge, const PoseState& state) {
  const double sigma = turn_sigma(knowledge, state.log_f);
  const double doubt = std::max(sigma, knowledge.motion_doubt.turn);
  Matrix3<double> covariance = Matrix3<double>::Zero();
  const std::optional<Mechanics<double>>& mount =
      knowledge.mechanics ? knowledge.mechanics : knowledge.turned_by;
  if (mount) {
    Matrix<double, 3, 2> J;
    (void)R_base_from_camera(*mount, nearest_angles(*mount, state.R).angle, &J);
    for (int i = 0; i < 2; ++i) {
      // A pan moves the image less the higher the camera looks.
      const double moving = std::max(0.1, J.col(i).head<2>().norm());
      covariance += std::pow(std::min(doubt, sigma / moving), 2) * J.col(i) * J.col(i).transpose();
    }
    const double off = kOffAxes * (sigma + knowledge.motion.angular_velocity.norm());
    covariance.diagonal().array() += off * off;
  } else {
    covariance(0, 0) = covariance(1, 1) = sigma * sigma;
    covariance(2, 2) = std::pow(std::max(sigma, std::min(doubt, kWidestRoll)), 2);
  }
  Matrix4<double> out = Matrix4<double>::Zero();
  out.topLeftCorner<3, 3>() = covariance.inverse();
  out(3, 3) = 1 / (zoom_sigma(knowledge) * zoom_sigma(knowledge));
  return out;
}

Vector4<double> motion_of(const PictureMotion& motion) {
  Vector4<double> out;
  out << motion.angular_velocity, motion.zoom_rate;
  return out;
}

struct NormalEquations {
  Square N;
  Unknowns b;
  double cost = 0;
  double sum_of_squares = 0;
  int used = 0;
};

NormalEquations normal_equations(const std::vector<PoseMatch>& matches,
                                 const std::vector<int>& inliers, const PoseKnowledge& knowledge,
                                 const Matrix4<double>& of_motion, const PoseState& state,
                                 double noise) {
  const int count = full_count(knowledge);
  NormalEquations out;
  out.N.setZero(count, count);
  out.b.setZero(count);
  CameraColumn<double> J_camera_log;
  const Camera<double> camera = knowledge.lens.camera_of(state.log_f, &J_camera_log);
  Residual residual;
  for (const int i : inliers) {
    if (!residual_of(matches[static_cast<std::size_t>(i)], state, camera, J_camera_log,
                     &residual)) {
      out.cost += 1e6;
      continue;
    }
    const double size = std::sqrt(residual.square);
    const double bend = kHuber_sigmas * noise;
    const double weight = size <= bend ? 1 : bend / size;
    out.cost += size <= bend ? residual.square : bend * (2 * size - bend);
    const auto J = residual.J.leftCols(count);
    const Eigen::Matrix<double, Eigen::Dynamic, 2, 0, kMostCount, 2> weighted =
        weight * J.transpose() * residual.information;
    out.N.noalias() += weighted.lazyProduct(J);
    out.b.noalias() += weighted.lazyProduct(residual.error);
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
  if (count > kPoseCount) {
    const Vector4<double> off = motion_of(knowledge.motion) - motion_of(state.motion);
    out.N.bottomRightCorner<4, 4>() += of_motion;
    out.b.tail<4>() += of_motion * off;
    out.cost += off.dot(of_motion * off);
  }
  return out;
}

// Derivative of all parameters by the unknowns: pan, tilt, log f of a mount, or xi, log f; then the
// motion.
Square directions_of_change(const PoseKnowledge& knowledge, const PoseState& state) {
  const int count = full_count(knowledge);
  const int of_motion = count - kPoseCount;
  const int of_pose = knowledge.mechanics ? 3 : kPoseCount;
  Square out = Square::Zero(count, of_pose + of_motion);
  if (knowledge.mechanics) {
    Matrix<double, 3, 2> J;
    (void)R_base_from_camera(*knowledge.mechanics, state.angle, &J);
    out.topLeftCorner<3, 2>() = J;
    out(3, 2) = 1;
  } else {
    out.topLeftCorner<4, 4>().setIdentity();
  }
  out.bottomRightCorner(of_motion, of_motion).setIdentity();
  return out;
}

PoseState moved(const PoseKnowledge& knowledge, const PoseState& state, const Unknowns& change) {
  PoseState out = state;
  const int of_pose = knowledge.mechanics ? 3 : kPoseCount;
  out.log_f += change[of_pose - 1];
  if (knowledge.mechanics) {
    out.angle = plus(state.angle, Vector2<double>(change.head<2>()));
    out.R = R_base_from_camera(*knowledge.mechanics, out.angle);
  } else {
    out.R = state.R * exp_so3(Vector3<double>(change.head<3>()));
  }
  if (change.size() > of_pose) {
    out.motion.angular_velocity += change.segment<3>(of_pose);
    out.motion.zoom_rate += change[of_pose + 3];
  }
  return out;
}

Matrix4<double> information_of_motion(const PoseKnowledge& knowledge, const PoseState& state) {
  return has_unknown_motion(knowledge) ? motion_information(knowledge, state)
                                       : Matrix4<double>(Matrix4<double>::Zero());
}

}  // namespace

bool moves_too_far(const PoseKnowledge& knowledge, const PoseState& state) {
  constexpr double kMost = 2;  // of the widest prior's sigmas
  const double turn_px = state.motion.angular_velocity.head<2>().norm() * std::exp(state.log_f);
  return turn_px > kMost * kWidestShift * knowledge.lens.width() ||
         std::abs(state.motion.zoom_rate) > kMost * kWidestZoom;
}

bool has_unknown_motion(const PoseKnowledge& knowledge) {
  return knowledge.motion_doubt.turn > 0 || knowledge.motion_doubt.log_f > 0;
}

bool adjust_pose(const std::vector<PoseMatch>& matches, const std::vector<int>& inliers,
                 const PoseKnowledge& knowledge, double noise, int max_steps, PoseState* state) {
  double damping = 1e-6;
  const Matrix4<double> of_motion = information_of_motion(knowledge, *state);
  NormalEquations at = normal_equations(matches, inliers, knowledge, of_motion, *state, noise);
  for (int step = 0; step < max_steps; ++step) {
    const Square A = directions_of_change(knowledge, *state);
    Square N = A.transpose() * at.N * A;
    const Unknowns b = A.transpose() * at.b;
    N.diagonal() *= 1 + damping;
    const Unknowns change = N.ldlt().solve(b);
    if (!change.allFinite() || change.norm() > 10) return false;
    const PoseState next = moved(knowledge, *state, change);
    const NormalEquations there =
        normal_equations(matches, inliers, knowledge, of_motion, next, noise);
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

// From the median, which outliers hardly move. A gate by the claimed sigmas alone would hide larger
// noise.
double noise_of(const std::vector<PoseMatch>& matches, const std::vector<int>& inliers,
                const PoseKnowledge& knowledge, const PoseState& state) {
  CameraColumn<double> J_camera_log;
  const Camera<double> camera = knowledge.lens.camera_of(state.log_f, &J_camera_log);
  std::vector<double> squares;
  Residual residual;
  for (const int i : inliers) {
    if (residual_of(matches[static_cast<std::size_t>(i)], state, camera, J_camera_log, &residual)) {
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
  CameraColumn<double> J_camera_log;
  const Camera<double> camera = knowledge.lens.camera_of(state.log_f, &J_camera_log);
  std::vector<int> out;
  Residual residual;
  for (const int i : candidates) {
    if (residual_of(matches[static_cast<std::size_t>(i)], state, camera, J_camera_log, &residual) &&
        residual.square < gate_sigmas * gate_sigmas) {
      out.push_back(i);
    }
  }
  return out;
}

std::optional<PoseFit> fit_of(const std::vector<PoseMatch>& matches,
                              const std::vector<int>& inliers, const PoseKnowledge& knowledge,
                              const PoseState& state, double noise) {
  const NormalEquations at = normal_equations(
      matches, inliers, knowledge, information_of_motion(knowledge, state), state, noise);
  const Square A = directions_of_change(knowledge, state);
  const Square N = A.transpose() * at.N * A;
  const Eigen::LLT<Square> factors(N);
  if (factors.info() != Eigen::Success) return std::nullopt;
  const auto unknowns = N.rows();
  const double freedom = std::max(1.0, 2.0 * at.used - static_cast<double>(unknowns));
  const double inflation = std::max(1.0, at.sum_of_squares / freedom);
  const Square covariance =
      inflation * A * factors.solve(Square::Identity(unknowns, unknowns)) * A.transpose();
  if (!covariance.allFinite()) return std::nullopt;
  PoseFit out;
  out.covariance = covariance.topLeftCorner<4, 4>();
  out.motion_covariance.setZero();
  if (covariance.rows() > kPoseCount) {
    out.motion_covariance = covariance.bottomRightCorner<4, 4>();
  }
  out.noise_scale = std::sqrt(at.sum_of_squares / freedom);
  return out;
}

}  // namespace internal

double motion_reach_px(const PoseKnowledge& knowledge, double log_f) {
  if (!internal::has_unknown_motion(knowledge)) return 0;
  return 0.5 * (internal::turn_sigma(knowledge, log_f) * std::exp(log_f) +
                internal::zoom_sigma(knowledge) * knowledge.lens.corner_px());
}

}  // namespace alidade
