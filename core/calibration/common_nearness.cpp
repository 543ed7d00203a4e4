#include "core/calibration/common_nearness.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>

namespace alidade::internal {

namespace {

// Mean of the inverse distances over their spread: 1 to 5 in scenes whose farthest thing is 30 to 2
// times as far as the nearest.
constexpr double kMeanOverSpread = 2;
// Of the logarithm of the spread of inverse distances, about that of a scene where all of them are
// equally frequent: things spread evenly over distance or its logarithm are within it.
constexpr double kSpreadDoubt = 0.5;

// The pupil as it is likely where the pictures show such a spread: the stated place is the prior,
// and the size of the place is the spread of nu over that of the inverse distances.
Pupil with_spread(Pupil pupil, const SceneDistance& scene, double spread) {
  constexpr double kSigmas = 6;
  constexpr int kSteps = 2000;
  const double of_distances = (1 / scene.nearest_m - 1 / scene.farthest_m) / std::sqrt(12.0);
  double& place = pupil.place_m.z();
  double& sigma = pupil.sigma_m.z();
  if (!(spread > 0) || !(sigma > 0)) return pupil;
  double weights = 0;
  double mean = 0;
  double square = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double z = kSigmas * (2 * (i + 0.5) / kSteps - 1);
    const double o = place + z * sigma;
    const double doubt = std::log(std::abs(o) * of_distances / spread) / kSpreadDoubt;
    const double weight = std::exp(-0.5 * (z * z + doubt * doubt));
    weights += weight;
    mean += weight * o;
    square += weight * o * o;
  }
  if (!(weights > 0)) return pupil;
  mean /= weights;
  sigma = std::sqrt(std::max(0.0, square / weights - mean * mean));
  place = mean;
  return pupil;
}

}  // namespace

Nearness common_nearness(const Pupil& pupil, const std::optional<SceneDistance>& scene,
                         double spread) {
  if (!scene) return {0, kMeanOverSpread * spread};
  return scene_nearness(with_spread(pupil, *scene, spread), *scene);
}

std::string scene_problem(const Pupil& pupil, const SceneDistance& scene,
                          const DepthSpread& shown) {
  constexpr double kSigmas = 3;
  const double pupil_m = std::abs(pupil.place_m.z()) + kSigmas * pupil.sigma_m.z();
  const double near = 1 / scene.nearest_m;
  const double far = 1 / scene.farthest_m;
  // Half of all at either end.
  const double most = pupil_m * (near - far) / 2;
  const double least = shown.sigma * (1 - kSigmas / std::sqrt(2 * std::max(1.0, shown.landmarks)));
  if (!(least > most)) return {};
  char text[400];
  std::snprintf(text, sizeof text,
                "the pictures show distances that differ by more than a scene from %g to %g m "
                "explains: from a pupil %.2g m before or behind the axes something is nearer than "
                "%.0f m; correct the scene's distances, or the pupil's place",
                scene.nearest_m, scene.farthest_m, pupil_m, 1 / (far + 2 * least / pupil_m));
  return text;
}

GlobalMatrix part_of_mean_nearness(const AdjustmentState& state, const Linearisation& at,
                                   double nearness_sigma, Adjustment* adjustment) {
  // a: the prior's information of each nearness. H x = a; x x^T / a^T x.
  const double a = 1 / (nearness_sigma * nearness_sigma);
  const std::size_t landmarks = state.nearness.size();
  const Eigen::Index first_global = at.H.rows() - kGlobalCount;
  const auto is_seen = [&](std::size_t l) { return at.touched_begin[l] < at.touched_begin[l + 1]; };
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(at.H.rows(), 1);
  for (std::size_t l = 0; l < landmarks; ++l) {
    const std::size_t block = landmarks + l;
    if (!is_seen(l)) continue;
    const double weight = a / at.H_landmark[block](0, 0);
    for (std::size_t i = at.touched_begin[block]; i < at.touched_begin[block + 1]; ++i)
      b.block<2, 1>(2 * at.touched[i], 0) -= weight * at.H_touched[i].col(0);
    b.block<kObservedCount, 1>(first_global, 0) -= weight * at.H_camera[block].col(0);
  }
  Eigen::MatrixXd x;
  Eigen::VectorXd step;
  if (!adjustment->solve_columns(at, b, &x, &step)) return GlobalMatrix::Zero();
  double square = 0;
  for (std::size_t l = 0; l < landmarks; ++l) {
    const std::size_t block = landmarks + l;
    if (!is_seen(l)) continue;
    double of_it = a;
    for (std::size_t i = at.touched_begin[block]; i < at.touched_begin[block + 1]; ++i)
      of_it -= at.H_touched[i].col(0).dot(x.block<2, 1>(2 * at.touched[i], 0));
    of_it -= at.H_camera[block].col(0).dot(x.block<kObservedCount, 1>(first_global, 0));
    square += a * of_it / at.H_landmark[block](0, 0);
  }
  if (!(square > 0)) return GlobalMatrix::Zero();
  const GlobalVector moved = x.bottomRows<kGlobalCount>();
  return moved * moved.transpose() / square;
}

}  // namespace alidade::internal
