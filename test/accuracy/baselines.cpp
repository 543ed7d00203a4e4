#include "test/accuracy/baselines.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <map>
#include <utility>

namespace alidade::test {
namespace {

// Pixels about the optical centre in units of half the width: well conditioned, and it keeps K diagonal.
Eigen::Vector2d normalised(const CalibrationInput& input, const CalibrationObservation& o) {
  return Eigen::Vector2d(o.u_px - input.width / 2.0, o.v_px - input.height / 2.0) /
         (input.width / 2.0);
}

using Tracks = std::vector<std::map<std::int64_t, Eigen::Vector2d>>;  // by frame and landmark

// det H = 1; empty with too few common landmarks.
std::optional<Eigen::Matrix3d> homography(const Tracks& tracks, std::size_t from, std::size_t to) {
  constexpr int kLeastCommon = 12;
  Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
  int common = 0;
  for (const auto& [landmark, a] : tracks[from]) {
    const auto found = tracks[to].find(landmark);
    if (found == tracks[to].end()) continue;
    ++common;
    const Eigen::Vector3d x = a.homogeneous();
    for (const int i : {0, 1}) {
      Eigen::Matrix<double, 9, 1> row = Eigen::Matrix<double, 9, 1>::Zero();
      row.segment<3>(3 * i) = x;
      row.segment<3>(6) = -found->second[i] * x;
      normal += row * row.transpose();
    }
  }
  if (common < kLeastCommon) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(normal);
  const Eigen::Matrix<double, 9, 1> h = solver.eigenvectors().col(0);
  Eigen::Matrix3d H;
  H << h.segment<3>(0).transpose(), h.segment<3>(3).transpose(), h.segment<3>(6).transpose();
  return Eigen::Matrix3d(H / std::cbrt(H.determinant()));
}

// Residual of one observation; parameters: log of the focal length over its first value, rotation about
// the true one (rad), direction about the true one (tangent plane).
struct Reprojection {
  Eigen::Matrix3d camera_from_base;  // true
  Eigen::Vector3d direction;         // true
  Eigen::Matrix<double, 3, 2> tangent;
  Eigen::Vector2d pixel;  // about the centre
  double focal_length;
  double sigma;

  template <class T>
  bool operator()(const T* log_focal, const T* rotation, const T* landmark, T* residual) const {
    const Eigen::Matrix<T, 3, 1> d =
        direction.cast<T>() +
        tangent.cast<T>() * Eigen::Map<const Eigen::Matrix<T, 2, 1>>(landmark);
    const Eigen::Matrix<T, 3, 1> unturned = camera_from_base.cast<T>() * d;
    Eigen::Matrix<T, 3, 1> c;
    ceres::AngleAxisRotatePoint(rotation, unturned.data(), c.data());
    const T f = T(focal_length) * exp(log_focal[0]);
    residual[0] = (f * c[0] / c[2] - T(pixel[0])) / T(sigma);
    residual[1] = (f * c[1] / c[2] - T(pixel[1])) / T(sigma);
    return true;
  }
};

}  // namespace

std::optional<double> focal_length_by_dlt(const SimulatedRecording& recording) {
  const CalibrationInput& input = recording.input;
  Tracks tracks(static_cast<std::size_t>(input.frames.back().frame) + 1);
  for (const CalibrationObservation& o : input.observations) {
    tracks[static_cast<std::size_t>(o.frame)][o.landmark] = normalised(input, o);
  }
  double bb = 0;
  double ab = 0;
  const Eigen::Matrix3d plane = Eigen::Vector3d(1, 1, 0).asDiagonal();
  const Eigen::Matrix3d depth = Eigen::Vector3d(0, 0, 1).asDiagonal();
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    for (std::size_t j = i + 1; j < tracks.size(); ++j) {
      const std::optional<Eigen::Matrix3d> H = homography(tracks, i, j);
      if (!H) continue;
      // (H plane H^T - plane) + (H depth H^T - depth) / f^2 = 0. Solved for 1 / f^2: at narrow fields the
      // first bracket is noise, the second one is not, and least squares for f^2 would shrink it.
      const Eigen::Matrix3d A = *H * plane * H->transpose() - plane;
      const Eigen::Matrix3d B = *H * depth * H->transpose() - depth;
      bb += B.squaredNorm();
      ab += A.cwiseProduct(B).sum();
    }
  }
  if (!(-ab > 0) || !(bb > 0)) return std::nullopt;
  return std::sqrt(bb / -ab) * input.width / 2;
}

std::optional<double> focal_length_by_adjustment(const std::vector<ZoomLevel>& levels) {
  std::map<std::pair<int, int>, Eigen::Vector2d> landmarks;
  std::vector<std::map<std::int64_t, Eigen::Vector3d>> rotations(levels.size());
  std::vector<double> log_focal(levels.size(), 0);
  ceres::Problem problem;
  auto* ordering = new ceres::ParameterBlockOrdering;  // the solver's options own it
  for (std::size_t n = 0; n < levels.size(); ++n) {
    const ZoomLevel& level = levels[n];
    const CalibrationInput& input = level.recording->input;
    std::map<std::int64_t, Eigen::Matrix3d> camera_from_base;
    for (std::size_t i = 0; i < input.frames.size(); ++i) {
      const Eigen::Vector2d angle = level.simulation->angles(level.recording->frame_time_s[i]);
      camera_from_base[input.frames[i].frame] =
          internal::camera_to_base(*level.simulation, angle).transpose();
      rotations[n][input.frames[i].frame].setZero();
    }
    for (const CalibrationObservation& o : input.observations) {
      const auto l = static_cast<std::size_t>(o.landmark);
      const Eigen::Vector2i place = level.grid_factor * level.recording->grid[l];
      double* landmark =
          landmarks.try_emplace({place[0], place[1]}, Eigen::Vector2d::Zero()).first->second.data();
      const Eigen::Vector3d& d = level.recording->landmarks[l];
      Eigen::Matrix<double, 3, 2> tangent;
      tangent.col(0) = d.unitOrthogonal();
      tangent.col(1) = d.cross(tangent.col(0));
      const Eigen::Vector2d pixel(o.u_px - input.width / 2.0, o.v_px - input.height / 2.0);
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<Reprojection, 2, 1, 3, 2>(new Reprojection{
              camera_from_base[o.frame], d, tangent, pixel, level.first_focal_length, o.sigma_px}),
          nullptr, &log_focal[n], rotations[n][o.frame].data(), landmark);
      ordering->AddElementToGroup(landmark, 0);
    }
    for (auto& [frame, rotation] : rotations[n]) {
      if (!problem.HasParameterBlock(rotation.data())) continue;
      ordering->AddElementToGroup(rotation.data(), 1);
    }
    ordering->AddElementToGroup(&log_focal[n], 1);
  }
  // The whole may turn freely: hold its first frame.
  for (auto& [frame, rotation] : rotations[0]) {
    if (!problem.HasParameterBlock(rotation.data())) continue;
    problem.SetParameterBlockConstant(rotation.data());
    break;
  }
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_SCHUR;
  options.linear_solver_ordering.reset(ordering);
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-12;  // at narrow fields the valley is flat
  options.parameter_tolerance = 1e-12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable() || summary.termination_type != ceres::CONVERGENCE) {
    return std::nullopt;
  }
  return levels.back().first_focal_length * std::exp(log_focal.back());
}

}  // namespace alidade::test
