#include "core/mapping/two_point_pose.h"

#include <algorithm>
#include <cmath>

#include "core/mapping/map_projection.h"

namespace alidade::internal {
namespace {

// Orthonormal frame: first axis along a, second in the plane of a and b.
std::optional<Matrix3<double>> frame_of(const Vector3<double>& a, const Vector3<double>& b) {
  const Vector3<double> normal = a.cross(b);
  const double sine = normal.norm();
  if (!(sine > 1e-9)) return std::nullopt;
  Matrix3<double> out;
  out.col(0) = a;
  out.col(2) = normal / sine;
  out.col(1) = out.col(2).cross(a);
  return out;
}

double angle_between(const Vector3<double>& a, const Vector3<double>& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// Rays of both pixels in the camera's frame at the reference row.
bool rays_of(const PoseMatch& a, const PoseMatch& b, const PoseKnowledge& knowledge, double log_f,
             Vector3<double>* ray_a, Vector3<double>* ray_b) {
  const Camera<double> camera = knowledge.lens.camera_of(log_f);
  const Matrix3<double> I = Matrix3<double>::Identity();
  return unproject_to_map(camera, knowledge.motion, I, a.u, ray_a) == ProjectionStatus::kOk &&
         unproject_to_map(camera, knowledge.motion, I, b.u, ray_b) == ProjectionStatus::kOk;
}

}  // namespace

std::optional<TwoPointPose> two_point_pose(const PoseMatch& a, const PoseMatch& b,
                                           const PoseKnowledge& knowledge) {
  const double wanted = angle_between(a.d_b, b.d_b);
  const double apart_px = (a.u - b.u).norm();
  if (!(wanted > 1e-7) || !(apart_px > 2) || !(wanted < 2.5)) return std::nullopt;
  // The log of the angle falls with log f with a slope near -1: Newton with that slope, then
  // secants.
  double log_f = std::clamp(std::log(apart_px / (2 * std::tan(wanted / 2))), knowledge.least_log_f,
                            knowledge.most_log_f);
  Vector3<double> ray_a;
  Vector3<double> ray_b;
  double slope = -1;
  double before_log_f = log_f;
  double before = 0;
  for (int step = 0; step < 20; ++step) {
    if (!rays_of(a, b, knowledge, log_f, &ray_a, &ray_b)) return std::nullopt;
    const double error = std::log(angle_between(ray_a, ray_b) / wanted);
    if (!std::isfinite(error)) return std::nullopt;
    if (step > 0 && std::abs(log_f - before_log_f) > 1e-14) {
      slope = std::clamp((error - before) / (log_f - before_log_f), -2.0, -0.3);
    }
    before = error;
    before_log_f = log_f;
    if (std::abs(error) < 1e-12) break;
    log_f -= error / slope;
    if (!(log_f >= knowledge.least_log_f - 1e-9 && log_f <= knowledge.most_log_f + 1e-9)) {
      return std::nullopt;
    }
  }
  if (!(std::abs(before) < 1e-9)) return std::nullopt;
  const auto seen = frame_of(ray_a, ray_b);
  const auto there = frame_of(a.d_b, b.d_b);
  if (!seen || !there) return std::nullopt;
  return TwoPointPose{*there * seen->transpose(), log_f};
}

}  // namespace alidade::internal
