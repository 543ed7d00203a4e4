#include "core/realtime/oe_mode/orientation_inliers.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/realtime/oe_mode/orientation_without_angles.h"

namespace alidade::internal {
namespace {

constexpr double kChiSquare2Median = 1.386;  // of 2 degrees of freedom
constexpr double kChiSquare2Gate = 13.8;     // 99.9 %
constexpr int kRobustSteps = 6;
constexpr int kGateSteps = 3;

double median(double* values, int count) {
  double* middle = values + count / 2;
  std::nth_element(values, middle, values + count);
  return *middle;
}

// Median of the angles from each landmark alone.
Vector2<double> middle_of_landmarks(const FoundLandmark* landmarks, int count) {
  std::array<double, kMaxFoundLandmarks> pan;
  std::array<double, kMaxFoundLandmarks> tilt;
  for (int i = 0; i < count; ++i) {
    const Vector2<double> angle = landmarks[i].J_angle.inverse() * landmarks[i].residual;
    pan[static_cast<std::size_t>(i)] = angle.x();
    tilt[static_cast<std::size_t>(i)] = angle.y();
  }
  return {median(pan.data(), count), median(tilt.data(), count)};
}

template <Unknowns unknowns>
void find_squares(const OrientationProblem& problem, const MotionAndLens& x, Squares* out) {
  for (int i = 0; i < problem.count(); ++i) {
    (*out)[static_cast<std::size_t>(i)] = problem.normalised_square<unknowns>(i, x);
  }
}

double median_square(const Squares& squares, int count) {
  Squares sorted;
  std::copy_n(squares.begin(), count, sorted.begin());
  return median(sorted.data(), count) / kChiSquare2Median;
}

}  // namespace

void find_squares(const OrientationProblem& problem, const MotionAndLens& x, Squares* out) {
  if (problem.zooms()) {
    find_squares<Unknowns::kAll>(problem, x, out);
  } else if (problem.lens() != nullptr) {
    find_squares<Unknowns::kMotionAndLens>(problem, x, out);
  } else {
    find_squares<Unknowns::kMotion>(problem, x, out);
  }
}

bool robust_start(const OrientationProblem& problem, const MotionPrior& prior,
                  const ScaledPrior& scaled, double unit_s, const SolveLimits& limits,
                  const FoundLandmark* landmarks, Fit* fit) {
  const int count = problem.count();
  MotionAndLens& x = fit->x;
  x.x.head<2>() = middle_of_landmarks(landmarks, count);
  if (prior.lens != nullptr) x.phi = prior.lens->value;
  if (prior.zoom != nullptr) x.zoom = {prior.zoom->value[0], unit_s * prior.zoom->value[1]};
  const double max_square = limits.max_scale * limits.max_scale;
  find_squares(problem, x, &fit->squares);
  for (int step = 0; step < kRobustSteps; ++step) {
    // The scale from the median. A scale that shrinks further would let a few landmarks capture the
    // rest.
    fit->scale_square = std::clamp(median_square(fit->squares, count), 1.0, max_square);
    const double c = 4 * fit->scale_square;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const double fall = c / (c + fit->squares[i]);
      fit->weights[i] = fall * fall;
    }
    x = solve_without_angles(problem, scaled, fit->weights.data(), fit->scale_square, false).best();
    if (!all_finite(x.x)) return false;
    find_squares(problem, x, &fit->squares);
  }
  return true;
}

bool gate(const OrientationProblem& problem, const ScaledPrior& scaled, const SolveLimits& limits,
          FoundLandmark* landmarks, Fit* fit) {
  const int count = problem.count();
  const double max_square = limits.max_scale * limits.max_scale;
  for (int step = 0; step < kGateSteps; ++step) {
    int inliers = 0;
    for (int i = 0; i < count; ++i) {
      const auto of_it = static_cast<std::size_t>(i);
      landmarks[i].inlier = fit->squares[of_it] < kChiSquare2Gate * fit->scale_square;
      fit->weights[of_it] = landmarks[i].inlier ? 1 : 0;
      inliers += landmarks[i].inlier ? 1 : 0;
    }
    fit->inliers = inliers;
    if (inliers < std::max(limits.min_inliers, kMinInliers + 1) ||
        inliers < limits.min_inlier_share * count) {
      return false;
    }
    fit->x =
        solve_without_angles(problem, scaled, fit->weights.data(), fit->scale_square, false).best();
    find_squares(problem, fit->x, &fit->squares);
    // The scale of the inliers, for the next step and the solution.
    fit->of_inliers = {0, 2.0 * inliers - 6};
    for (int i = 0; i < count; ++i) {
      if (landmarks[i].inlier) fit->of_inliers.sum += fit->squares[static_cast<std::size_t>(i)];
    }
    fit->scale_square = std::clamp(fit->of_inliers.sum / fit->of_inliers.freedom, 1.0, max_square);
  }
  return true;
}

ResidualSquares neighbours_squares(const OrientationProblem& problem,
                                   const FoundLandmark* landmarks, double width, double height,
                                   const ImageCells& cells, const MotionAndLens& x,
                                   LargeAverages* averages) {
  struct Cell {
    Matrix2<double> information = Matrix2<double>::Zero();
    Vector2<double> sum = Vector2<double>::Zero();
    bool used = false;
  };
  std::array<Cell, kSmallCells.columns * kSmallCells.rows> all;
  for (int i = 0; i < problem.count(); ++i) {
    if (!landmarks[i].inlier) continue;
    const Vector2<double>& u = landmarks[i].u;
    const int column =
        std::clamp(static_cast<int>(u.x() / width * cells.columns), 0, cells.columns - 1);
    const int row = std::clamp(static_cast<int>(u.y() / height * cells.rows), 0, cells.rows - 1);
    Cell& cell = all[static_cast<std::size_t>(row * cells.columns + column)];
    cell.information += problem.term(i).information;
    cell.sum += problem.term(i).information * problem.left(i, x);
    cell.used = true;
  }
  ResidualSquares out{0, -cells.absorbed};
  for (const Cell& cell : all) {
    if (!cell.used) continue;
    out.freedom += 2;
    out.sum += cell.sum.dot(inverse_of(cell.information) * cell.sum);
  }
  for (std::size_t i = 0; averages != nullptr && i < kLargeCellCount; ++i) {
    for (Eigen::Index k = 0; all[i].used && k < 2; ++k) {
      (*averages)[2 * i + static_cast<std::size_t>(k)] =
          all[i].sum[k] / std::sqrt(all[i].information(k, k));
    }
  }
  return out;
}

}  // namespace alidade::internal
