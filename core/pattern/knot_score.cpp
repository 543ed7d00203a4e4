#include "core/pattern/knot_score.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "core/model/median.h"
#include "core/pattern/moving_projection.h"

namespace alidade::internal {
namespace {

// Effect of a change x of the pose at an observation's exposure: its cost becomes |r + J x|^2.
struct Scored {
  double time_s = 0;
  Vector2<double> r;
  Matrix<double, 2, 6> J;
};

std::vector<Scored> scored(const PatternData& data, const PatternMask& used,
                           const PatternState& state, double sigma_px) {
  std::vector<Scored> all;
  for_each_projection(
      data, state.lens, state.curve, true,
      [&](std::size_t f, std::size_t i, const MovingProjection& projection) {
        if (used[f][i] == 0) return;
        const Vector2<double> error = projection.u - data.frames[f].observations[i].u;
        all.push_back({projection.time_s, error / sigma_px, projection.J_u_x / sigma_px});
      });
  return all;
}

struct Step {
  std::vector<double> gain;  // of each observation
  int unknowns = 0;          // that the data determine
};

// The best change of the control points of a curve with these knots.
Step best_step(const std::vector<Scored>& all, const PoseCurve& spline) {
  using Normal = Matrix<double, 24, 24>;
  const int size = 6 * spline.control_points();
  std::vector<Normal> N(static_cast<std::size_t>(spline.segments()), Normal::Zero());
  Eigen::VectorXd g = Eigen::VectorXd::Zero(size);
  std::vector<SplineBasis> bases;
  bases.reserve(all.size());
  for (const Scored& s : all) {
    bases.push_back(spline.basis(s.time_s, bases.empty() ? 0 : bases.back().segment));
    const SplineBasis& basis = bases.back();
    const Matrix<double, 6, 6> information = s.J.transpose() * s.J;
    const Matrix<double, 6, 1> b = s.J.transpose() * s.r;
    Normal& of_segment = N[static_cast<std::size_t>(basis.segment)];
    for (int i = 0; i < 4; ++i) {
      g.segment<6>(6 * (basis.segment + i)) -= basis.weight[i] * b;
      for (int j = 0; j <= i; ++j)
        of_segment.block<6, 6>(6 * i, 6 * j) += basis.weight[i] * basis.weight[j] * information;
    }
  }
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(N.size() * 300 + static_cast<std::size_t>(size));
  Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(size);
  for (int s = 0; s < spline.segments(); ++s) {
    const Normal& of_segment = N[static_cast<std::size_t>(s)];
    for (int i = 0; i < 24; ++i) {
      diagonal[6 * s + i] += of_segment(i, i);
      for (int j = 0; j <= i; ++j) {
        if (i / 6 == j / 6 || of_segment(i, j) != 0)
          entries.emplace_back(6 * s + i, 6 * s + j, of_segment(i, j));
      }
    }
  }
  // Control points that the data hardly reach stay where they are.
  Step step;
  const double floor = 1e-6 * diagonal.maxCoeff();
  for (int i = 0; i < size; ++i) {
    entries.emplace_back(i, i, 1e-2 * floor);
    step.unknowns += diagonal[i] > floor ? 1 : 0;
  }
  Eigen::SparseMatrix<double> H(size, size);
  H.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower,
                              Eigen::NaturalOrdering<int>>
      ldlt(H);
  step.gain.assign(all.size(), 0);
  if (ldlt.info() != Eigen::Success) return step;
  const Eigen::VectorXd x = ldlt.solve(g);
  for (std::size_t i = 0; i < all.size(); ++i) {
    Matrix<double, 6, 1> change = Matrix<double, 6, 1>::Zero();
    for (int k = 0; k < 4; ++k)
      change += bases[i].weight[k] * x.segment<6>(6 * (bases[i].segment + k));
    step.gain[i] = all[i].r.squaredNorm() - (all[i].r + all[i].J * change).squaredNorm();
  }
  return step;
}

// Times of the frames that are used.
std::vector<double> times_used(const PatternData& data, const PatternMask& used) {
  std::vector<double> times;
  for (std::size_t f = 0; f < data.frames.size(); ++f) {
    if (std::count(used[f].begin(), used[f].end(), char{1}) > 0)
      times.push_back(data.frames[f].time_s);
  }
  return times;
}

// Interval of these times around a segment; the median, so that a pause at its end does not count.
double interval_about(const std::vector<double>& times, double begin_s, double end_s) {
  const auto first = times.begin();
  const auto at = [&](double t) { return std::lower_bound(first, times.end(), t) - first; };
  const auto last = static_cast<std::ptrdiff_t>(times.size()) - 1;
  const std::ptrdiff_t from = std::max<std::ptrdiff_t>(at(begin_s) - 2, 0);
  const std::ptrdiff_t to = std::min<std::ptrdiff_t>(at(end_s) + 1, last);
  std::vector<double> intervals;
  for (std::ptrdiff_t i = from; i < to; ++i) intervals.push_back(first[i + 1] - first[i]);
  return intervals.empty() ? 0 : median(std::move(intervals));
}

// The gain that noise exceeds in one of `tests` tests, with six degrees of freedom each, once in a
// hundred times.
double beyond_chance(int tests) {
  const double probability = 0.01 / std::max(1, tests);
  double x = 20;
  // P(chi^2_6 > x) = exp(-x / 2) (1 + x / 2 + x^2 / 8): a fixed point of its logarithm.
  for (int i = 0; i < 20; ++i) x = 2 * std::log((1 + x / 2 + x * x / 8) / probability);
  return x;
}

}  // namespace

KnotScore score_knots(const PatternData& data, const PatternMask& used, const PatternState& state,
                      const KnotScoreOptions& options) {
  const PoseCurve& curve = state.curve;
  const auto segments = static_cast<std::size_t>(curve.segments());
  const std::vector<Scored> all = scored(data, used, state, options.sigma_px);
  std::vector<int> population(segments, 0);
  for (const Scored& s : all) ++population[static_cast<std::size_t>(curve.segment_at(s.time_s))];
  std::vector<int> every(segments);
  std::iota(every.begin(), every.end(), 0);
  const Step coarse = best_step(all, curve);
  const Step fine = best_step(all, curve.split(every));
  std::vector<double> gain(segments, 0);
  for (std::size_t i = 0; i < all.size(); ++i) {
    gain[static_cast<std::size_t>(curve.segment_at(all[i].time_s))] +=
        fine.gain[i] - coarse.gain[i];
  }
  constexpr int kLeastObservations = 12;  // in a segment: twice what its new knot adds
  std::vector<char> can(segments, 0);
  const std::vector<double> times = times_used(data, used);
  KnotScore score;
  int tests = 0;
  for (std::size_t s = 0; s < segments; ++s) {
    if (population[s] < kLeastObservations) continue;
    const auto i = static_cast<int>(s);
    const double shortest_s =
        options.shortest_frames * interval_about(times, curve.knot(i), curve.knot(i + 1));
    can[s] = curve.knot(i + 1) - curve.knot(i) >= 2 * shortest_s ? 1 : 0;
    tests += can[s];
    (can[s] != 0 ? score.gain : score.gain_of_short) += gain[s];
    (can[s] != 0 ? score.expected : score.expected_of_short) += 6;
  }
  const bool all_beyond_chance = score.gain > score.expected + 3 * std::sqrt(2 * score.expected);
  const double threshold = all_beyond_chance ? 6 : beyond_chance(tests);
  for (std::size_t s = 0; s < segments; ++s) {
    if (can[s] != 0 && gain[s] > threshold) score.split.push_back(static_cast<int>(s));
  }
  return score;
}

double observation_noise(const PatternData& data, const PatternMask& used,
                         const PatternState& state, double frame_interval_s) {
  const std::vector<Scored> all = scored(data, used, state, 1);
  std::vector<double> knots;
  const double begin = state.curve.begin_s();
  const int count = std::max(1, static_cast<int>((state.curve.end_s() - begin) / frame_interval_s));
  for (int i = 0; i <= count; ++i)
    knots.push_back(begin + (state.curve.end_s() - begin) * i / count);
  const Step step = best_step(all, PoseCurve(knots));
  double sum = 0;
  for (std::size_t i = 0; i < all.size(); ++i) sum += all[i].r.squaredNorm() - step.gain[i];
  const double freedom = 2 * static_cast<double>(all.size()) - step.unknowns;
  if (!(freedom > 0)) return 0;
  constexpr double kLeast = 1e-6;  // px; of points without noise the sum is what rounding leaves
  return std::sqrt(std::max(kLeast * kLeast, sum / freedom));
}

}  // namespace alidade::internal
