#include "core/realtime/oe_mode/orientation_solve.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace alidade {
namespace {

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

// A landmark as the sums want it, times in units of half the read-out.
struct Term {
  Matrix2<double> information;  // 1/px^2
  Matrix2<double> JtWJ;
  Matrix<double, 2, 2> JtW;
  double t;
};

class Problem {
 public:
  Problem(FoundLandmark* landmarks, int count, double unit_s)
      : landmarks_(landmarks), count_(count), unit_s_(unit_s) {
    for (int i = 0; i < count; ++i) {
      const FoundLandmark& landmark = landmarks[i];
      Term& term = terms_[static_cast<std::size_t>(i)];
      term.information = inverse_of(landmark.covariance);
      term.JtW = landmark.J_angle.transpose() * term.information;
      term.JtWJ = term.JtW * landmark.J_angle;
      term.t = landmark.time_s / unit_s;
    }
  }

  // Of x in scaled units, from landmarks with these weights.
  void normal_equations(const double* weights, Matrix6* N, Vector6* b) const {
    Matrix2<double> A[5];
    Vector2<double> c[3];
    for (Matrix2<double>& a : A) a.setZero();
    for (Vector2<double>& v : c) v.setZero();
    for (int i = 0; i < count_; ++i) {
      if (weights[i] == 0) continue;
      const Term& term = terms_[static_cast<std::size_t>(i)];
      Matrix2<double> a = weights[i] * term.JtWJ;
      Vector2<double> v = weights[i] * (term.JtW * landmarks_[i].residual);
      for (int power = 0; power < 5; ++power) {
        A[power] += a;
        a *= term.t;
      }
      for (int power = 0; power < 3; ++power) {
        c[power] += v;
        v *= term.t;
      }
    }
    *N << A[0], A[1], A[2] / 2,  //
        A[1], A[2], A[3] / 2,    //
        A[2] / 2, A[3] / 2, A[4] / 4;
    *b << c[0], c[1], c[2] / 2;
  }

  // The right-hand side of normal_equations(), of sensitivities in place of residuals, inliers only.
  [[nodiscard]] Sensitivity<6> right_of_sensitivities() const {
    std::array<Sensitivity<2>, 3> c;
    for (Sensitivity<2>& m : c) m.setZero();
    for (int i = 0; i < count_; ++i) {
      if (!landmarks_[i].inlier) continue;
      const Term& term = terms_[static_cast<std::size_t>(i)];
      const Sensitivity<2> v = term.JtW * landmarks_[i].sensitivity;
      c[0] += v;
      c[1] += term.t * v;
      c[2] += (0.5 * term.t * term.t) * v;
    }
    Sensitivity<6> right;
    right << c[0], c[1], c[2];
    return right;
  }

  [[nodiscard]] Vector2<double> left(int i, const Vector6& x) const {
    const double t = terms_[static_cast<std::size_t>(i)].t;
    return landmarks_[i].residual - landmarks_[i].J_angle * angle_at(x, t);
  }

  [[nodiscard]] double normalised_square(int i, const Vector6& x) const {
    const Vector2<double> r = left(i, x);
    return r.dot(terms_[static_cast<std::size_t>(i)].information * r);
  }

  [[nodiscard]] const Term& term(int i) const { return terms_[static_cast<std::size_t>(i)]; }
  [[nodiscard]] int count() const { return count_; }

  // Scaled = D unscaled.
  [[nodiscard]] Vector6 scaling() const {
    Vector6 D;
    D << 1, 1, unit_s_, unit_s_, unit_s_ * unit_s_, unit_s_ * unit_s_;
    return D;
  }

 private:
  FoundLandmark* landmarks_;
  int count_;
  double unit_s_;
  std::array<Term, kMaxFoundLandmarks> terms_;
};

// Telemetry and prior in scaled units.
struct ScaledPrior {
  Matrix6 motion_information;
  Vector6 motion_b;
  Matrix2<double> rate_information = Matrix2<double>::Zero();
  Vector2<double> rate = Vector2<double>::Zero();
  Matrix4<double> telemetry_information = Matrix4<double>::Zero();
  Vector4<double> telemetry = Vector4<double>::Zero();
};

ScaledPrior scale(const MotionPrior& prior, double unit_s, const Vector6& D) {
  ScaledPrior out;
  const Vector6 inverse = D.cwiseInverse();
  out.motion_information = inverse.asDiagonal() * prior.motion_information * inverse.asDiagonal();
  out.motion_b = out.motion_information * D.cwiseProduct(prior.motion);
  if (prior.has_telemetry) {
    const Vector4<double> D4(1, 1, unit_s, unit_s);
    const Matrix4<double> covariance =
        D4.asDiagonal() * prior.telemetry_covariance * D4.asDiagonal();
    out.telemetry_information = covariance.inverse();
    out.telemetry = D4.cwiseProduct(prior.telemetry);
    out.rate_information = inverse_of(covariance.bottomRightCorner<2, 2>());
    out.rate = out.telemetry.tail<2>();
  }
  return out;
}

// x from landmarks, the frames before and telemetry's rates, without its angles.
Vector6 solve_without_angles(const Problem& problem, const ScaledPrior& prior,
                             const double* weights, double inflation, Matrix6* covariance) {
  Matrix6 N;
  Vector6 b;
  problem.normal_equations(weights, &N, &b);
  N /= inflation;
  b /= inflation;
  N += prior.motion_information;
  b += prior.motion_b;
  N.block<2, 2>(2, 2) += prior.rate_information;
  b.segment<2>(2) += prior.rate_information * prior.rate;
  const Eigen::LDLT<Matrix6> factor(N);
  if (covariance != nullptr) *covariance = factor.solve(Matrix6::Identity());
  return factor.solve(b);
}

// What most landmarks say about the angles alone.
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

void find_squares(const Problem& problem, const Vector6& x, Squares* out) {
  for (int i = 0; i < problem.count(); ++i) {
    (*out)[static_cast<std::size_t>(i)] = problem.normalised_square(i, x);
  }
}

double median_square(const Squares& squares, int count) {
  Squares sorted;
  std::copy_n(squares.begin(), count, sorted.begin());
  return median(sorted.data(), count) / kChiSquare2Median;
}

// Residuals against their covariances, averaged over neighbours: 1 if they are independent.
double neighbours_inflation(const Problem& problem, const FoundLandmark* landmarks, double width,
                            double height, const Vector6& x) {
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
  const Problem problem(landmarks, count, unit_s);
  const Vector6 D = problem.scaling();
  const ScaledPrior scaled = scale(prior, unit_s, D);

  Vector6 x = Vector6::Zero();
  x.head<2>() = middle_of_landmarks(landmarks, count);
  const double max_square = limits.max_scale * limits.max_scale;
  double scale_square = 1;
  Squares squares;  // at x
  find_squares(problem, x, &squares);
  std::array<double, kMaxFoundLandmarks> weights;
  constexpr int kRobustSteps = 6;
  for (int step = 0; step < kRobustSteps; ++step) {
    // The scale that half of the landmarks show; a shrinking one lets few capture the rest.
    scale_square = std::clamp(median_square(squares, count), 1.0, max_square);
    const double c = 4 * scale_square;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const double fall = c / (c + squares[i]);
      weights[i] = fall * fall;
    }
    x = solve_without_angles(problem, scaled, weights.data(), scale_square, nullptr);
    if (!all_finite(x)) return SolveStatus::kNotFinite;
    find_squares(problem, x, &squares);
  }

  // All or nothing, by the scale of those that are in.
  int inliers = 0;
  Matrix6 covariance;
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
    x = solve_without_angles(problem, scaled, weights.data(), scale_square, &covariance);
    find_squares(problem, x, &squares);
    double square = 0;
    for (int i = 0; i < count; ++i) {
      if (landmarks[i].inlier) square += squares[static_cast<std::size_t>(i)];
    }
    scale_square = std::clamp(square / (2 * inliers - 6), 1.0, max_square);
  }
  const double inflation =
      std::max(scale_square, neighbours_inflation(problem, landmarks, width, height, x));
  x = solve_without_angles(problem, scaled, weights.data(), inflation, &covariance);

  // What the landmarks have in common counts as an offset of this frame's own.
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

  const Sensitivity<6> right_of_sensitivities =
      problem.right_of_sensitivities() / inflation +
      scaled.motion_information * (D.asDiagonal() * prior.motion_sensitivity);
  Sensitivity<8> sensitivity = Sensitivity<8>::Zero();
  Vector8 solution = Vector8::Zero();
  Matrix8 posterior = Matrix8::Zero();
  out->contradiction = 0;
  if (prior.has_telemetry) {
    const Matrix4<double> telemetry_covariance = scaled.telemetry_information.inverse();
    out->innovation = scaled.telemetry.head<2>() - x.head<2>();
    out->innovation_covariance =
        telemetry_covariance.topLeftCorner<2, 2>() + covariance.topLeftCorner<2, 2>();
    const Matrix2<double> expected = out->innovation_covariance + prior_offset;
    out->contradiction = out->innovation.dot(inverse_of(expected) * out->innovation);
    if (!(out->contradiction < limits.max_contradiction)) return SolveStatus::kContradiction;

    // The rates were used once already: here again from the beginning, with the angles.
    Matrix6 N;
    Vector6 b;
    problem.normal_equations(weights.data(), &N, &b);
    Matrix8 all = Matrix8::Zero();
    all.topLeftCorner<6, 6>() = N / inflation + scaled.motion_information;
    // An offset known exactly has no information matrix; nothing is known to a millionth of this.
    constexpr double kLeastVariance = 1e-20;  // rad^2
    all.bottomRightCorner<2, 2>() =
        inverse_of(prior_offset + kLeastVariance * Matrix2<double>::Identity());
    Vector8 right = Vector8::Zero();
    right.head<6>() = b / inflation + scaled.motion_b;
    Matrix<double, 4, 8> H = Matrix<double, 4, 8>::Zero();
    H.topLeftCorner<4, 4>().setIdentity();
    H.topRightCorner<2, 2>().setIdentity();
    all += H.transpose() * scaled.telemetry_information * H;
    right += H.transpose() * (scaled.telemetry_information * scaled.telemetry);
    const Eigen::LDLT<Matrix8> factor(all);
    solution = factor.solve(right);
    posterior = factor.solve(Matrix8::Identity());
    const Vector4<double> D4(1, 1, unit_s, unit_s);
    sensitivity.topRows<6>() = right_of_sensitivities;
    sensitivity += H.transpose() *
                   (scaled.telemetry_information * (D4.asDiagonal() * prior.telemetry_sensitivity));
    sensitivity = (posterior * sensitivity).eval();
  } else {
    solution.head<6>() = x;
    sensitivity.topRows<6>() = covariance * right_of_sensitivities;
    posterior.topLeftCorner<6, 6>() = covariance;
    posterior.bottomRightCorner<2, 2>() = prior_offset;
  }

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
  for (int i = 0; i < count; ++i) {
    landmarks[i].normalised_square = problem.normalised_square(i, solution.head<6>());
  }
  // What nothing tells has no finite variance, and the factorisation gives it none.
  if (!all_finite(out->correction) || !all_finite(out->covariance) ||
      !all_finite(out->offset_correction) || !(out->covariance.diagonal().minCoeff() > 0)) {
    return SolveStatus::kNotFinite;
  }
  return SolveStatus::kOk;
}

}  // namespace alidade
