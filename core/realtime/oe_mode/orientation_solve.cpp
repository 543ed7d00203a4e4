#include "core/realtime/oe_mode/orientation_solve.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/realtime/oe_mode/orientation_problem.h"

namespace alidade {
namespace {

using internal::LensRow;
using internal::MotionAndLens;
using internal::OrientationProblem;
using internal::ScaledPrior;
using internal::Unknowns;
using internal::ZoomRows;

using Matrix8 = Matrix<double, 8, 8>;
using Vector8 = Matrix<double, 8, 1>;

constexpr int kMinInliers = 3;               // for 6 unknowns, whatever the limits say
constexpr double kChiSquare2Median = 1.386;  // of 2 degrees of freedom
constexpr double kChiSquare2Gate = 13.8;     // 99.9 %

double median(double* values, int count) {
  double* middle = values + count / 2;
  std::nth_element(values, middle, values + count);
  return *middle;
}

// The row of phi, from landmarks and previous frames.
LensRow row_of_lens(const OrientationProblem& problem, const ScaledPrior& prior,
                    const double* weights, double inflation, const ZoomRows* zoom) {
  LensRow row = problem.lens_row(weights);
  if (zoom != nullptr) zoom->eliminate(&row);
  const Vector6 prior_c = prior.motion_information * prior.motion_by_lens;
  row.c = row.c / inflation + prior_c;
  row.information = row.information / inflation + prior_c.dot(prior.motion_by_lens);
  row.b = row.b / inflation - prior_c.dot(prior.motion);
  return row;
}

// Solution from landmarks, previous frames and telemetry's rates, without its angles: x at phi = 0,
// its dependence on phi, and phi from those alone.
struct WithoutAngles {
  Vector6 x;
  Matrix6 covariance;
  LensRow row;
  Vector6 by_lens = Vector6::Zero();
  double information = 0;
  double phi = 0;  // with its prior
  double phi_information = 0;
  ZoomRows zoom;

  [[nodiscard]] MotionAndLens best() const {
    const Vector6 at = x + phi * by_lens;
    return {at, phi, zoom.at(at, phi)};
  }
};

WithoutAngles solve_without_angles(const OrientationProblem& problem, const ScaledPrior& prior,
                                   const double* weights, double inflation, bool with_covariance) {
  Matrix6 N;
  Vector6 b;
  problem.normal_equations(weights, &N, &b);
  WithoutAngles out;
  if (problem.zooms()) {
    out.zoom = problem.zoom_rows(weights, inflation);
    out.zoom.eliminate(&N, &b);
  }
  N /= inflation;
  b /= inflation;
  N += prior.motion_information;
  b += prior.motion_b;
  N.block<2, 2>(2, 2) += prior.rate_information;
  b.segment<2>(2) += prior.rate_information * prior.rate;
  const Eigen::LDLT<Matrix6> factor(N);
  if (with_covariance) out.covariance = factor.solve(Matrix6::Identity());
  out.x = factor.solve(b);
  const LensScale* lens = problem.lens();
  if (lens == nullptr) return out;
  out.row = row_of_lens(problem, prior, weights, inflation, problem.zooms() ? &out.zoom : nullptr);
  out.by_lens = factor.solve(out.row.c);
  // Landmarks made with this lens have no information on it, but for rounding.
  out.information = std::max(0.0, out.row.information - out.row.c.dot(out.by_lens));
  const double known = 1 / lens->variance;
  out.phi_information = out.information / prior.scale_inflation + known;
  out.phi = ((out.row.b + out.row.c.dot(out.x)) / prior.scale_inflation + known * lens->value) /
            out.phi_information;
  return out;
}

// Adapts the innovation and its expected covariance to phi as known from landmarks and its prior.
void expect_of_lens(const LensScale& lens, const WithoutAngles& own, Vector2<double>* innovation,
                    Matrix2<double>* expected) {
  const Vector2<double> offset_by_phi = lens.covariance_with_offset / lens.variance;
  const Vector2<double> by_phi = own.by_lens.head<2>() + offset_by_phi;
  *innovation -= own.phi * own.by_lens.head<2>() + (own.phi - lens.value) * offset_by_phi;
  *expected += by_phi * by_phi.transpose() / own.phi_information -
               offset_by_phi * lens.covariance_with_offset.transpose();
}

// Covariance of the innovation from errors of the calibration. right: change of the right-hand side
// of `own` with the parameters.
Matrix2<double> innovation_by_calibration(const MotionPrior& prior, const WithoutAngles& own,
                                          const Sensitivity<6>& right) {
  const Sensitivity<2> of_landmarks = own.covariance.topRows<2>() * right;
  const Sensitivity<2> of_both = prior.telemetry_sensitivity.topRows<2>() - of_landmarks;
  const Matrix2<double> out =
      of_both * prior.lens->others * of_both.transpose() +
      of_landmarks * prior.zoom->own_variances.asDiagonal() * of_landmarks.transpose();
  return symmetric(out);
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

using Squares = std::array<double, kMaxFoundLandmarks>;  // normalised, by landmark

template <Unknowns unknowns>
void find_squares(const OrientationProblem& problem, const MotionAndLens& x, Squares* out) {
  for (int i = 0; i < problem.count(); ++i) {
    (*out)[static_cast<std::size_t>(i)] = problem.normalised_square<unknowns>(i, x);
  }
}

void find_squares(const OrientationProblem& problem, const MotionAndLens& x, Squares* out) {
  if (problem.zooms()) {
    find_squares<Unknowns::kAll>(problem, x, out);
  } else if (problem.lens() != nullptr) {
    find_squares<Unknowns::kMotionAndLens>(problem, x, out);
  } else {
    find_squares<Unknowns::kMotion>(problem, x, out);
  }
}

double median_square(const Squares& squares, int count) {
  Squares sorted;
  std::copy_n(squares.begin(), count, sorted.begin());
  return median(sorted.data(), count) / kChiSquare2Median;
}

// Squared mean residuals of neighbours over their covariances: 1 if the residuals are independent.
double neighbours_inflation(const OrientationProblem& problem, const FoundLandmark* landmarks,
                            double width, double height, const MotionAndLens& x) {
  constexpr int kColumns = 10;
  constexpr int kRows = 6;
  struct Cell {
    Matrix2<double> information = Matrix2<double>::Zero();
    Vector2<double> sum = Vector2<double>::Zero();
    bool used = false;
  };
  std::array<Cell, kColumns * kRows> cells;
  for (int i = 0; i < problem.count(); ++i) {
    if (!landmarks[i].inlier) continue;
    const int column =
        std::clamp(static_cast<int>(landmarks[i].u.x() / width * kColumns), 0, kColumns - 1);
    const int row = std::clamp(static_cast<int>(landmarks[i].u.y() / height * kRows), 0, kRows - 1);
    Cell& cell = cells[static_cast<std::size_t>(row * kColumns + column)];
    cell.information += problem.term(i).information;
    cell.sum += problem.term(i).information * problem.left(i, x);
    cell.used = true;
  }
  int freedom = -6;
  double square = 0;
  for (const Cell& cell : cells) {
    if (!cell.used) continue;
    freedom += 2;
    square += cell.sum.dot(inverse_of(cell.information) * cell.sum);
  }
  return freedom > 6 ? square / freedom : 1;
}

}  // namespace

SolveStatus solve_orientation(FoundLandmark* landmarks, int count, const MotionPrior& prior,
                              const SolveLimits& limits, double width, double height,
                              double half_readout_s, SolvedMotion* out) {
  count = std::min(count, kMaxFoundLandmarks);
  if (count < std::max(limits.min_inliers, kMinInliers)) return SolveStatus::kTooFew;
  const double unit_s = std::max(std::abs(half_readout_s), limits.min_half_readout_s);
  const LensScale* lens = prior.lens;
  const OrientationProblem problem(landmarks, count, unit_s, lens, prior.zoom);
  const Vector6 D = problem.scaling();
  const ScaledPrior scaled = internal::scaled(prior, unit_s, D);

  MotionAndLens x;
  x.x.head<2>() = middle_of_landmarks(landmarks, count);
  if (lens != nullptr) x.phi = lens->value;
  if (prior.zoom != nullptr) x.zoom = {prior.zoom->value[0], unit_s * prior.zoom->value[1]};
  const double max_square = limits.max_scale * limits.max_scale;
  double scale_square = 1;
  Squares squares;  // at x
  find_squares(problem, x, &squares);
  std::array<double, kMaxFoundLandmarks> weights;
  constexpr int kRobustSteps = 6;
  for (int step = 0; step < kRobustSteps; ++step) {
    // The scale from the median. A scale that shrinks further would let a few landmarks capture the
    // rest.
    scale_square = std::clamp(median_square(squares, count), 1.0, max_square);
    const double c = 4 * scale_square;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const double fall = c / (c + squares[i]);
      weights[i] = fall * fall;
    }
    x = solve_without_angles(problem, scaled, weights.data(), scale_square, false).best();
    if (!all_finite(x.x)) return SolveStatus::kNotFinite;
    find_squares(problem, x, &squares);
  }

  // Inlier or not, by the scale of the inliers.
  int inliers = 0;
  constexpr int kGateSteps = 3;
  for (int step = 0; step < kGateSteps; ++step) {
    inliers = 0;
    for (int i = 0; i < count; ++i) {
      const auto of_it = static_cast<std::size_t>(i);
      landmarks[i].inlier = squares[of_it] < kChiSquare2Gate * scale_square;
      weights[of_it] = landmarks[i].inlier ? 1 : 0;
      inliers += landmarks[i].inlier ? 1 : 0;
    }
    if (inliers < std::max(limits.min_inliers, kMinInliers + 1) ||
        inliers < limits.min_inlier_share * count) {
      return SolveStatus::kTooFew;
    }
    x = solve_without_angles(problem, scaled, weights.data(), scale_square, false).best();
    find_squares(problem, x, &squares);
    double square = 0;
    for (int i = 0; i < count; ++i) {
      if (landmarks[i].inlier) square += squares[static_cast<std::size_t>(i)];
    }
    scale_square = std::clamp(square / (2 * inliers - 6), 1.0, max_square);
  }
  const double inflation =
      std::max(scale_square, neighbours_inflation(problem, landmarks, width, height, x));
  const WithoutAngles own = solve_without_angles(problem, scaled, weights.data(), inflation, true);

  // The landmarks' common error counts as an offset of this frame.
  Matrix2<double> shared = Matrix2<double>::Zero();
  double total = 0;
  for (int i = 0; i < count; ++i) {
    if (!landmarks[i].inlier) continue;
    const double weight = problem.term(i).JtWJ.trace();
    shared += weight * landmarks[i].shared_covariance;
    total += weight;
  }
  shared /= total;
  const Matrix2<double> prior_offset = prior.offset_covariance + shared;

  ZoomRows zoom;
  Sensitivity<2> zoom_of_sensitivities = Sensitivity<2>::Zero();
  if (problem.zooms()) {
    zoom = problem.zoom_rows(weights.data(), inflation);
    zoom_of_sensitivities = problem.zoom_rows_of_sensitivities(inflation);
  }
  Sensitivity<6> right_of_landmarks = problem.right_of_sensitivities();
  if (problem.zooms()) right_of_landmarks -= zoom.C * (zoom.inverse * zoom_of_sensitivities);
  const Sensitivity<6> right_of_sensitivities =
      right_of_landmarks / inflation +
      scaled.motion_information * (D.asDiagonal() * prior.motion_sensitivity);
  Sensitivity<8> sensitivity = Sensitivity<8>::Zero();
  Vector8 solution = Vector8::Zero();
  Matrix8 posterior = Matrix8::Zero();
  Sensitivity<6> right_of_own;
  if (lens != nullptr) {
    right_of_own = right_of_sensitivities;
    right_of_own.middleRows<2>(2) +=
        scaled.rate_information * (unit_s * prior.telemetry_sensitivity.bottomRows<2>());
  }
  out->contradiction = 0;
  if (prior.has_telemetry) {
    const Matrix4<double> telemetry_covariance = scaled.telemetry_information.inverse();
    out->innovation = scaled.telemetry.head<2>() - own.x.head<2>();
    out->innovation_covariance =
        telemetry_covariance.topLeftCorner<2, 2>() + own.covariance.topLeftCorner<2, 2>();
    Matrix2<double> expected = out->innovation_covariance + prior_offset;
    Vector2<double> unexpected = out->innovation;
    if (lens != nullptr) expect_of_lens(*lens, own, &unexpected, &expected);
    if (problem.zooms()) {
      out->zoom.innovation_by_calibration = innovation_by_calibration(prior, own, right_of_own);
      expected += out->zoom.innovation_by_calibration;
    }
    out->contradiction = unexpected.dot(inverse_of(expected) * unexpected);
    if (!(out->contradiction < limits.max_contradiction)) {
      out->innovation = unexpected;
      return SolveStatus::kContradiction;
    }
  }
  if (prior.has_telemetry || lens != nullptr) {
    // The rates are already used in `own`: start again, with the angles.
    Matrix6 N;
    Vector6 b;
    problem.normal_equations(weights.data(), &N, &b);
    if (problem.zooms()) zoom.eliminate(&N, &b);
    Matrix8 all = Matrix8::Zero();
    all.topLeftCorner<6, 6>() = N / inflation + scaled.motion_information;
    Vector8 right = Vector8::Zero();
    right.head<6>() = b / inflation + scaled.motion_b;
    sensitivity.topRows<6>() = right_of_sensitivities;
    // An exactly known offset has no information matrix. Nothing is known to a millionth of this.
    constexpr double kLeastVariance = 1e-20;  // rad^2
    const Matrix2<double> offset_covariance =
        prior_offset + kLeastVariance * Matrix2<double>::Identity();
    if (prior.has_telemetry) {
      Matrix<double, 4, 8> H = Matrix<double, 4, 8>::Zero();
      H.topLeftCorner<4, 4>().setIdentity();
      H.topRightCorner<2, 2>().setIdentity();
      all += H.transpose() * scaled.telemetry_information * H;
      right += H.transpose() * (scaled.telemetry_information * scaled.telemetry);
      const Vector4<double> D4(1, 1, unit_s, unit_s);
      sensitivity += H.transpose() * (scaled.telemetry_information *
                                      (D4.asDiagonal() * prior.telemetry_sensitivity));
    }
    if (lens == nullptr) {
      all.bottomRightCorner<2, 2>() += inverse_of(offset_covariance);
      const Eigen::LDLT<Matrix8> factor(all);
      solution = factor.solve(right);
      posterior = factor.solve(Matrix8::Identity());
      sensitivity = (posterior * sensitivity).eval();
    } else {
      // Information of the prior of (g, phi).
      Matrix3<double> known;
      known << offset_covariance, lens->covariance_with_offset,
          lens->covariance_with_offset.transpose(), lens->variance;
      known = known.inverse().eval();
      const Vector2<double> known_both = known.topRightCorner<2, 1>();
      all.bottomRightCorner<2, 2>() += known.topLeftCorner<2, 2>();
      right.tail<2>() += known_both * lens->value;
      Vector8 c;
      c << right_of_sensitivities * lens->direction, -known_both;
      sensitivity.bottomRows<2>() += known_both * lens->sensitivity;
      const Eigen::LDLT<Matrix8> factor(all);
      solution = factor.solve(right);
      posterior = factor.solve(Matrix8::Identity());
      sensitivity = (posterior * sensitivity).eval();

      Sensitivity<1> of_landmarks = problem.lens_row_of_sensitivities();
      if (problem.zooms()) {
        of_landmarks -= (zoom.inverse * zoom.c).transpose() * zoom_of_sensitivities;
      }
      const Sensitivity<1> of_row =
          of_landmarks / inflation +
          (scaled.motion_information * scaled.motion_by_lens).transpose() * D.asDiagonal() *
              prior.motion_sensitivity;
      SolvedLens& solved = out->lens;
      solved.innovation_by_lens = own.by_lens.head<2>();
      solved.information = own.information;
      if (own.information > 0) {
        solved.measured = (own.row.b + own.row.c.dot(own.x)) / own.information;
        solved.measured_sensitivity =
            (own.by_lens.transpose() * right_of_own - of_row) / own.information;
      }
      // Removes the share that earlier frames said already.
      const double old = (1 - 1 / prior.scale_inflation) * own.information;
      const Vector8 by_lens = posterior * c;
      const double information = own.row.information - old + known(2, 2) - c.dot(by_lens);
      solved.variance = 1 / information;
      solved.value = solved.variance * (own.row.b - old * solved.measured +
                                        known(2, 2) * lens->value + c.dot(solution));
      solved.sensitivity =
          solved.variance * (known(2, 2) * lens->sensitivity - of_row -
                             old * solved.measured_sensitivity + c.transpose() * sensitivity);
      solved.motion_by_lens = by_lens.head<6>().cwiseQuotient(D);
      solved.offset_by_lens = by_lens.tail<2>();
      const Vector6 at = solution.head<6>() + solved.value * by_lens.head<6>();
      x = {at, solved.value, zoom.at(at, solved.value)};
      if (problem.zooms()) {
        const Vector2<double> of_unit(1, 1 / unit_s);
        const Matrix<double, 2, 6> gain = of_unit.asDiagonal() * zoom.inverse * zoom.C.transpose();
        out->zoom.correction = of_unit.cwiseProduct(zoom.at(solution.head<6>(), 0));
        out->zoom.covariance =
            inflation * of_unit.asDiagonal() * zoom.inverse * of_unit.asDiagonal();
        out->zoom.covariance += gain * posterior.topLeftCorner<6, 6>() * gain.transpose();
        out->zoom.sensitivity = of_unit.asDiagonal() * zoom.inverse * zoom_of_sensitivities;
        out->zoom.sensitivity -= gain * sensitivity.topRows<6>();
        out->zoom.by_lens = of_unit.cwiseProduct(zoom.by_lens(by_lens.head<6>()));
        if (!all_finite(out->zoom.correction) || !all_finite(out->zoom.covariance) ||
            !all_finite(out->zoom.by_lens)) {
          return SolveStatus::kNotFinite;
        }
      }
      if (!std::isfinite(solved.value) || !(solved.variance > 0) ||
          !all_finite(solved.sensitivity) || !all_finite(by_lens)) {
        return SolveStatus::kNotFinite;
      }
    }
  } else {
    solution.head<6>() = own.x;
    sensitivity.topRows<6>() = own.covariance * right_of_sensitivities;
    posterior.topLeftCorner<6, 6>() = own.covariance;
    posterior.bottomRightCorner<2, 2>() = prior_offset;
  }
  if (lens == nullptr) x.x = solution.head<6>();

  const Vector6 unscale = D.cwiseInverse();
  Matrix<double, 6, 8> to_base = Matrix<double, 6, 8>::Zero();
  to_base.topLeftCorner<6, 6>() = unscale.asDiagonal();
  out->frame_covariance =
      unscale.asDiagonal() * posterior.topLeftCorner<6, 6>() * unscale.asDiagonal();
  out->shared_covariance = shared;
  to_base.topRightCorner<2, 2>().setIdentity();
  out->covariance = to_base * posterior * to_base.transpose();
  out->correction = unscale.cwiseProduct(solution.head<6>());
  out->offset_correction = solution.tail<2>();
  out->sensitivity = unscale.asDiagonal() * sensitivity.topRows<6>();
  out->offset_correction_sensitivity = sensitivity.bottomRows<2>();
  out->inliers = inliers;
  out->inflation = inflation;
  find_squares(problem, x, &squares);
  for (int i = 0; i < count; ++i) {
    landmarks[i].normalised_square = squares[static_cast<std::size_t>(i)];
  }
  // An unknown that nothing determines has no finite variance. The factorisation then gives no
  // valid one.
  if (!all_finite(out->correction) || !all_finite(out->covariance) ||
      !all_finite(out->offset_correction) || !(out->covariance.diagonal().minCoeff() > 0)) {
    return SolveStatus::kNotFinite;
  }
  return SolveStatus::kOk;
}

}  // namespace alidade
