#include "core/calibration/telemetry_fit.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "core/model/median.h"

namespace alidade::internal {

void unwrap(std::vector<AdjustmentTelemetry>* telemetry) {
  constexpr std::size_t kMemory = 5;
  for (int axis = 0; axis < 2; ++axis) {
    for (std::size_t i = 1; i < telemetry->size(); ++i) {
      std::vector<double> recent;
      for (std::size_t j = i - std::min(i, kMemory); j < i; ++j) {
        recent.push_back((*telemetry)[j].measured[axis]);
      }
      const double near = median(std::move(recent));
      double& angle = (*telemetry)[i].measured[axis];
      angle = near + wrap_angle(angle - near);
    }
  }
}

std::optional<TrajectorySpline> fit_telemetry(const std::vector<AdjustmentTelemetry>& telemetry,
                                              double shift_s, double begin_s, double end_s,
                                              double spacing_s, double* sigma) {
  std::vector<const AdjustmentTelemetry*> inside;
  for (const auto& sample : telemetry) {
    const double time = sample.time_s - shift_s;
    if (time >= begin_s && time <= end_s) inside.push_back(&sample);
  }
  if (inside.size() < 8) return std::nullopt;
  // Segments with too few samples are joined with the next.
  constexpr int kSamplesPerSegment = 2;
  const double length = end_s - begin_s;
  const int segments = std::max(1, static_cast<int>(std::ceil(length / spacing_s)));
  std::vector<int> population(static_cast<std::size_t>(segments), 0);
  for (const auto* sample : inside) {
    const double place = (sample->time_s - shift_s - begin_s) / length * segments;
    ++population[static_cast<std::size_t>(std::clamp(static_cast<int>(place), 0, segments - 1))];
  }
  std::vector<double> knots = {begin_s};
  int held = 0;
  for (int s = 0; s < segments; ++s) {
    held += population[static_cast<std::size_t>(s)];
    if (held < kSamplesPerSegment) continue;
    knots.push_back(begin_s + length * (s + 1) / segments);
    held = 0;
  }
  // The end replaces the last knot.
  if (knots.size() > 1) knots.pop_back();
  knots.push_back(end_s);

  TrajectorySpline spline(knots);
  const int points = spline.control_points();
  std::vector<double> weight(inside.size(), 1.0);
  std::vector<double> error(inside.size());
  for (int pass = 0; pass < 8; ++pass) {
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::MatrixXd right = Eigen::MatrixXd::Zero(points, 2);
    for (std::size_t i = 0; i < inside.size(); ++i) {
      const auto basis = spline.basis(inside[i]->time_s - shift_s);
      for (int a = 0; a < 4; ++a) {
        const double w = weight[i] * basis.weight[a];
        right.row(basis.segment + a) += w * inside[i]->measured.transpose();
        for (int b = 0; b <= a; ++b) {
          entries.emplace_back(basis.segment + a, basis.segment + b, w * basis.weight[b]);
        }
      }
    }
    // Holds control points with few samples: a weight of 1e-6 on differences between neighbours.
    for (int a = 0; a < points; ++a) {
      entries.emplace_back(a, a, a == 0 || a == points - 1 ? 1e-6 : 2e-6);
      if (a > 0) entries.emplace_back(a, a - 1, -1e-6);
    }
    Eigen::SparseMatrix<double> H(points, points);
    H.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower,
                                Eigen::NaturalOrdering<int>>
        ldlt(H);
    if (ldlt.info() != Eigen::Success) return std::nullopt;
    const Eigen::MatrixXd solution = ldlt.solve(right);
    if (!solution.allFinite()) return std::nullopt;
    for (int a = 0; a < points; ++a) spline.control_point(a) = solution.row(a).transpose();
    for (std::size_t i = 0; i < inside.size(); ++i) {
      error[i] =
          (inside[i]->measured - spline.position(inside[i]->time_s - shift_s).vector()).norm();
    }
    // The median length of a 2-vector of unit noise is sqrt(2 ln 2).
    const double scale = std::max(median(error) / std::sqrt(2 * std::log(2.0)), 1e-12);
    if (sigma != nullptr) *sigma = scale;
    for (std::size_t i = 0; i < inside.size(); ++i) {
      const double x = error[i] / (3 * scale);
      weight[i] = 1 / ((1 + x * x) * (1 + x * x));
    }
  }
  return spline;
}

}  // namespace alidade::internal
