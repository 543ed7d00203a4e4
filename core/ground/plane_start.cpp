#include "core/ground/plane_start.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/model/rotation.h"

namespace alidade::internal {
namespace {

using Kind = PlaneDatumKind;

const PlaneDatum* first_of(const PlaneProblem& problem, Kind kind) {
  for (std::size_t i = 0; i < problem.evidence.data.size(); ++i) {
    if (problem.counts(i) && problem.evidence.data[i].kind == kind)
      return &problem.evidence.data[i];
  }
  return nullptr;
}

// The axis at right angles to all level directions: those of the horizon, and normals of planes
// through the camera that contain a vertical line.
std::optional<Vector3<double>> axis_of_right_angles(const PlaneProblem& problem) {
  Eigen::MatrixXd sum = Matrix3<double>::Zero();
  for (std::size_t i = 0; i < problem.evidence.data.size(); ++i) {
    if (!problem.counts(i)) continue;
    const PlaneDatum& datum = problem.evidence.data[i];
    Vector3<double> level = datum.sight.d_b;
    if (datum.kind == Kind::kUpright) {
      level = datum.sight.d_b.cross(datum.other.d_b).normalized();
    } else if (datum.kind != Kind::kHorizon && datum.kind != Kind::kBearing) {
      continue;
    }
    sum += level * level.transpose();
  }
  const SymmetricEigen eigen(sum);
  if (!(eigen.eigenvalues()[1] > 1e-6)) return std::nullopt;
  return Vector3<double>(eigen.eigenvectors().col(0));
}

std::vector<Vector3<double>> ups(const PlaneProblem& problem) {
  if (const PlaneDatum* level = first_of(problem, Kind::kLevel)) return {level->place};
  if (const PlaneDatum* vertical = first_of(problem, Kind::kVertical))
    return {vertical->sight.d_b, -vertical->sight.d_b};
  if (const auto axis = axis_of_right_angles(problem)) return {*axis, -*axis};
  std::vector<Vector3<double>> out;
  for (int axis = 0; axis < 3; ++axis) {
    out.emplace_back(Vector3<double>::Unit(axis));
    out.emplace_back(-Vector3<double>::Unit(axis));
  }
  for (int corner = 0; corner < 8; ++corner) {
    out.emplace_back(Vector3<double>((corner & 1) != 0 ? 1 : -1, (corner & 2) != 0 ? 1 : -1,
                                     (corner & 4) != 0 ? 1 : -1)
                         .normalized());
  }
  return out;
}

// The smallest rotation that takes z to `up_b`, a unit vector. Eigen's FromTwoVectors() uses a
// singular value decomposition, which takes half of this source's compilation.
Matrix3<double> R_base_from_world_with(const Vector3<double>& up_b) {
  const double w = std::sqrt(std::max(0.0, 0.5 * (1 + up_b.z())));
  if (w < 1e-8) {
    return Vector3<double>(1, -1, -1).asDiagonal();
  }
  return Eigen::Quaterniond(w, -0.5 * up_b.y() / w, 0.5 * up_b.x() / w, 0)
      .normalized()
      .toRotationMatrix();
}

// The camera's height by one datum, from a plane at height 1; nothing if the datum does not give
// it.
std::optional<double> height_by(const PlaneDatum& datum, const WorldPlane& unit) {
  Vector2<double> a;
  Vector2<double> b;
  switch (datum.kind) {
    case Kind::kHeight:
      return datum.value;
    case Kind::kLength:
      if (plane_point(unit, datum.sight.d_b, &a) != PlaneStatus::kOk ||
          plane_point(unit, datum.other.d_b, &b) != PlaneStatus::kOk) {
        return std::nullopt;
      }
      return datum.value / (b - a).norm();
    case Kind::kUpright: {
      if (plane_point(unit, datum.sight.d_b, &a) != PlaneStatus::kOk) return std::nullopt;
      // Above the foot, at its distance along the ground.
      const Vector3<double> head_w = unit.R_base_from_world.transpose() * datum.other.d_b;
      const double along = (a - unit.position.head<2>()).norm();
      const double top = unit.height() + along * head_w.z() / head_w.head<2>().norm();
      if (!(top > 0)) return std::nullopt;
      return datum.value / top;
    }
    default:
      return std::nullopt;
  }
}

// Place and height from all data on the camera's place; a point's ray counts as two equations.
void set_position(const PlaneProblem& problem, WorldPlane* plane) {
  WorldPlane unit = *plane;
  unit.position = Vector3<double>::UnitZ();
  std::vector<double> heights;
  Matrix3<double> A = Matrix3<double>::Zero();
  Vector3<double> b = Vector3<double>::Zero();
  for (std::size_t i = 0; i < problem.evidence.data.size(); ++i) {
    const PlaneDatum& datum = problem.evidence.data[i];
    if (!problem.counts(i)) continue;
    Matrix3<double> across = Matrix3<double>::Zero();
    if (datum.kind == Kind::kPoint) {
      const Vector3<double> d_w = plane->R_base_from_world.transpose() * datum.sight.d_b;
      across = Matrix3<double>::Identity() - d_w * d_w.transpose();
    } else if (datum.kind == Kind::kPlace) {
      across.topLeftCorner<2, 2>().setIdentity();
    }
    A += across;
    b += across * datum.place;
    const std::optional<double> height = height_by(datum, unit);
    if (height && std::isfinite(*height)) heights.push_back(*height);
  }
  double height = 1;
  if (!heights.empty()) {
    std::nth_element(heights.begin(), heights.begin() + static_cast<long>(heights.size() / 2),
                     heights.end());
    height = heights[heights.size() / 2];
    A(2, 2) += 1;
    b[2] += height;
  }
  A += 1e-9 * Matrix3<double>::Identity();
  plane->position = A.ldlt().solve(b);
  if (!(plane->position.z() > 0)) plane->position.z() = std::max(height, 0.1);
}

// Misfit of a start; logarithmic, so that one datum far off does not hide the others.
double badness(const PlaneProblem& problem, const WorldPlane& start) {
  const PlaneState state{
      start, Eigen::VectorXd::Zero(3 * static_cast<Eigen::Index>(problem.roots.size()))};
  double sum = 0;
  for (std::size_t i = 0; i < problem.evidence.data.size(); ++i) {
    if (!problem.counts(i)) continue;
    DatumResidual residual;
    const bool says = datum_residual(problem.evidence.data[i], problem.roots, state, &residual);
    sum += std::log1p(says ? residual.r.dot(residual.covariance.inverse() * residual.r) : 1e12);
  }
  return sum;
}

}  // namespace

std::vector<WorldPlane> plane_starts(const PlaneProblem& problem, int most) {
  const PlaneDatum* known = first_of(problem, Kind::kHeading);
  const bool defined = problem.frame == PlaneFrame::kCamera || problem.frame == PlaneFrame::kPlace;
  const int headings = defined || known != nullptr ? 1 : 8;
  std::vector<std::pair<double, WorldPlane>> rated;
  for (const Vector3<double>& up_b : ups(problem)) {
    for (int i = 0; i < headings; ++i) {
      WorldPlane start;
      start.R_base_from_world = R_base_from_world_with(up_b);
      const double wanted = known != nullptr ? known->value : i * 2 * kPi / headings;
      start.R_base_from_world = start.R_base_from_world *
                                rotation_about(Vector3<double>(0, 0, 1), wanted - heading(start));
      set_position(problem, &start);
      start = in_frame(problem.frame, start);
      rated.emplace_back(badness(problem, start), start);
    }
  }
  std::stable_sort(rated.begin(), rated.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<WorldPlane> out;
  for (const auto& [bad, start] : rated) {
    if (static_cast<int>(out.size()) < most) out.push_back(start);
  }
  return out;
}

}  // namespace alidade::internal
