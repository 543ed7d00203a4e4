#include "core/calibration/knot_choice.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>

namespace alidade::internal {

namespace {

constexpr double kUnknowns = 2;  // that a new knot adds: pan and tilt

// All that one frame, or one telemetry sample, says about a change x of the angles at its time:
// cost(x) = cost(0) - 2 b^T x + x^T N x.
struct Pointing {
  double time_s = 0;
  double weight = 0;
  Matrix2<double> N = Matrix2<double>::Zero();
  Vector2<double> b = Vector2<double>::Zero();

  void add(const LinearisedResidual& residual) {
    const Matrix2<double> information = residual.J_angle.transpose() * residual.J_angle;
    const double w = information.trace();
    N += information;
    b += residual.J_angle.transpose() * residual.error;
    time_s += w * residual.time_s;
    weight += w;
  }
};

std::vector<Pointing> pointings(const AdjustmentData& data, const Linearisation& linearisation) {
  std::vector<Pointing> frames(data.frame_time_s.size());
  for (std::size_t i = 0; i < data.observations.size(); ++i) {
    if (!data.observations[i].used || !linearisation.observations[i].valid) continue;
    frames[static_cast<std::size_t>(data.observations[i].frame)].add(linearisation.observations[i]);
  }
  std::vector<Pointing> all;
  for (const Pointing& frame : frames) {
    if (frame.weight > 0) all.push_back(frame);
  }
  for (std::size_t i = 0; i < data.telemetry.size(); ++i) {
    if (!data.telemetry[i].used) continue;
    all.emplace_back();
    all.back().add(linearisation.telemetry[i]);
  }
  for (Pointing& pointing : all) pointing.time_s /= pointing.weight;
  return all;
}

// Reduction of each pointing's cost by the best change of the spline's control points.
std::vector<double> gains(const std::vector<Pointing>& pointings, const TrajectorySpline& spline) {
  const int size = 2 * spline.control_points();
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(pointings.size() * 40);
  Eigen::VectorXd g = Eigen::VectorXd::Zero(size);
  double largest = 0;
  std::vector<TrajectorySpline::Basis> bases;
  bases.reserve(pointings.size());
  for (const Pointing& p : pointings) {
    bases.push_back(spline.basis(p.time_s, bases.empty() ? 0 : bases.back().segment));
    const auto& basis = bases.back();
    largest = std::max(largest, p.N.trace());
    for (int i = 0; i < 4; ++i) {
      g.segment<2>(2 * (basis.segment + i)) += basis.weight[i] * p.b;
      for (int j = 0; j <= i; ++j) {
        const Matrix2<double> block = basis.weight[i] * basis.weight[j] * p.N;
        for (int k = 0; k < 4; ++k) {
          entries.emplace_back(2 * (basis.segment + i) + k / 2, 2 * (basis.segment + j) + k % 2,
                               block(k / 2, k % 2));
        }
      }
    }
  }
  // Control points without data stay where they are.
  for (int i = 0; i < size; ++i) entries.emplace_back(i, i, 1e-9 * largest);
  Eigen::SparseMatrix<double> H(size, size);
  H.setFromTriplets(entries.begin(), entries.end());
  entries = std::vector<Eigen::Triplet<double>>();  // larger than H
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower,
                              Eigen::NaturalOrdering<int>>
      ldlt(H);
  std::vector<double> result(pointings.size(), 0.0);
  if (ldlt.info() != Eigen::Success) return result;
  const Eigen::VectorXd x = ldlt.solve(g);
  for (std::size_t i = 0; i < pointings.size(); ++i) {
    Vector2<double> change = Vector2<double>::Zero();
    for (int k = 0; k < 4; ++k) {
      change += bases[i].weight[k] * x.segment<2>(2 * (bases[i].segment + k));
    }
    result[i] = 2 * change.dot(pointings[i].b) - change.dot(pointings[i].N * change);
  }
  return result;
}

// For each segment: whether it and its neighbours gain more than noise does by 4 standard
// deviations. With 16 of them that is twice the expectation.
std::vector<bool> halving_pays(const std::vector<double>& gain) {
  constexpr std::size_t kNeighbours = 16;
  constexpr double kSigmas = 4;
  const std::size_t count = std::min(kNeighbours, gain.size());
  const double expected = kUnknowns * static_cast<double>(count);
  const double limit = expected + kSigmas * std::sqrt(2 * expected);
  std::vector<bool> pays(gain.size());
  for (std::size_t s = 0; s < gain.size(); ++s) {
    const std::size_t from = std::min(s - std::min(s, count / 2), gain.size() - count);
    const auto first = gain.begin() + static_cast<std::ptrdiff_t>(from);
    pays[s] = std::accumulate(first, first + static_cast<std::ptrdiff_t>(count), 0.0) > limit;
  }
  return pays;
}

}  // namespace

KnotChoice choose_knots(const AdjustmentData& data, const TrajectorySpline& trajectory,
                        const Linearisation& linearisation) {
  const auto segments = static_cast<std::size_t>(trajectory.segments());
  std::vector<int> all_segments(segments);
  std::iota(all_segments.begin(), all_segments.end(), 0);
  const TrajectorySpline halved = trajectory.split(all_segments);
  const std::vector<Pointing> all = pointings(data, linearisation);
  const std::vector<double> coarse = gains(all, trajectory);
  const std::vector<double> fine = gains(all, halved);
  std::vector<double> gain(segments, 0.0);
  std::vector<int> population(2 * segments, 0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    gain[static_cast<std::size_t>(trajectory.segment_at(all[i].time_s))] += fine[i] - coarse[i];
    ++population[static_cast<std::size_t>(halved.segment_at(all[i].time_s))];
  }

  KnotChoice choice;
  choice.expected = kUnknowns * static_cast<double>(segments);
  for (const double g : gain) choice.gain += g;
  const std::vector<bool> pays = halving_pays(gain);
  const double one_beyond_chance = 2 * std::log(100.0 * static_cast<double>(segments));
  for (std::size_t s = 0; s < segments; ++s) {
    const bool supported = population[2 * s] >= 2 && population[2 * s + 1] >= 2;
    if (supported && gain[s] > (pays[s] ? kUnknowns : one_beyond_chance)) {
      choice.split.push_back(static_cast<int>(s));
    }
  }
  return choice;
}

}  // namespace alidade::internal
