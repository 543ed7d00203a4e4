#include "core/realtime/oe_mode/orientation_posterior.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>

namespace alidade::internal {
namespace {

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

// The normal equations of (x, g), without the prior of g.
struct JointEquations {
  Matrix8 all = Matrix8::Zero();
  Vector8 right = Vector8::Zero();
  Sensitivity<8> sensitivity = Sensitivity<8>::Zero();  // of the right-hand side
  Matrix2<double> offset_covariance;                    // the prior of g
};

JointEquations joint_equations(const Given& given, const FromLandmarks& landmarks) {
  const MotionPrior& prior = given.prior;
  const ScaledPrior& scaled = given.scaled;
  JointEquations out;
  // The rates are already used in `own`: start again, with the angles.
  Matrix6 N;
  Vector6 b;
  given.problem.normal_equations(landmarks.weights, &N, &b);
  if (given.problem.zooms()) landmarks.zoom.eliminate(&N, &b);
  out.all.topLeftCorner<6, 6>() = N / landmarks.inflation + scaled.motion_information;
  out.right.head<6>() = b / landmarks.inflation + scaled.motion_b;
  out.sensitivity.topRows<6>() = landmarks.right_of_sensitivities;
  // An exactly known offset has no information matrix. Nothing is known to a millionth of this.
  constexpr double kLeastVariance = 1e-20;  // rad^2
  out.offset_covariance = landmarks.prior_offset + kLeastVariance * Matrix2<double>::Identity();
  if (prior.has_telemetry) {
    Matrix<double, 4, 8> H = Matrix<double, 4, 8>::Zero();
    H.topLeftCorner<4, 4>().setIdentity();
    H.topRightCorner<2, 2>().setIdentity();
    out.all += H.transpose() * scaled.telemetry_information * H;
    out.right += H.transpose() * (scaled.telemetry_information * scaled.telemetry);
    const Vector4<double> D4(1, 1, given.unit_s, given.unit_s);
    out.sensitivity += H.transpose() * (scaled.telemetry_information *
                                        (D4.asDiagonal() * prior.telemetry_sensitivity));
  }
  return out;
}

// Solves for x and g.
Posterior solved(const Eigen::LDLT<Matrix8>& factor, const JointEquations& equations) {
  Posterior out;
  out.solution = factor.solve(equations.right);
  out.covariance = factor.solve(Matrix8::Identity());
  out.sensitivity = out.covariance * equations.sensitivity;
  return out;
}

// The frame's own lens, once (x, g) are known. at_zero: scaled x at phi = 0. by_lens: its change
// per unit of phi. False if a result is not finite.
bool solve_zoom(const Given& given, const FromLandmarks& landmarks, const Posterior& posterior,
                const Vector8& by_lens, SolvedZoom* out) {
  const ZoomRows& zoom = landmarks.zoom;
  const Vector2<double> of_unit(1, 1 / given.unit_s);
  const Matrix<double, 2, 6> gain = of_unit.asDiagonal() * zoom.inverse * zoom.C.transpose();
  out->correction = of_unit.cwiseProduct(zoom.at(posterior.solution.head<6>(), 0));
  out->covariance =
      landmarks.inflation * of_unit.asDiagonal() * zoom.inverse * of_unit.asDiagonal();
  out->covariance += gain * posterior.covariance.topLeftCorner<6, 6>() * gain.transpose();
  out->sensitivity = of_unit.asDiagonal() * zoom.inverse * landmarks.zoom_of_sensitivities;
  out->sensitivity -= gain * posterior.sensitivity.topRows<6>();
  out->by_lens = of_unit.cwiseProduct(zoom.by_lens(by_lens.head<6>()));
  return all_finite(out->correction) && all_finite(out->covariance) && all_finite(out->by_lens);
}

// rad^2; the landmarks' shared covariances, averaged with their weights.
Matrix2<double> common_error(const OrientationProblem& problem, const FoundLandmark* landmarks) {
  Matrix2<double> shared = Matrix2<double>::Zero();
  double total = 0;
  for (int i = 0; i < problem.count(); ++i) {
    if (!landmarks[i].inlier) continue;
    const double weight = problem.term(i).JtWJ.trace();
    shared += weight * landmarks[i].shared_covariance;
    total += weight;
  }
  shared /= total;
  return shared;
}

}  // namespace

FromLandmarks sums_of_landmarks(const Given& given, const FoundLandmark* landmarks,
                                const double* weights, double inflation, Matrix2<double>* shared) {
  const OrientationProblem& problem = given.problem;
  const MotionPrior& prior = given.prior;
  FromLandmarks out;
  out.weights = weights;
  out.inflation = inflation;
  out.own = solve_without_angles(problem, given.scaled, weights, inflation, true);
  // The landmarks' common error counts as an offset of this frame.
  *shared = common_error(problem, landmarks);
  out.prior_offset = prior.offset_covariance + *shared;
  if (problem.zooms()) {
    out.zoom = problem.zoom_rows(weights, inflation);
    out.zoom_of_sensitivities = problem.zoom_rows_of_sensitivities(inflation);
  }
  Sensitivity<6> right_of_landmarks = problem.right_of_sensitivities();
  if (problem.zooms())
    right_of_landmarks -= out.zoom.C * (out.zoom.inverse * out.zoom_of_sensitivities);
  out.right_of_sensitivities =
      right_of_landmarks / inflation +
      given.scaled.motion_information * (given.D.asDiagonal() * prior.motion_sensitivity);
  if (prior.lens != nullptr) {
    out.right_of_own = out.right_of_sensitivities;
    out.right_of_own.middleRows<2>(2) +=
        given.scaled.rate_information *
        (given.unit_s * prior.telemetry_sensitivity.bottomRows<2>());
  }
  return out;
}

bool agree_with_telemetry(const Given& given, const FromLandmarks& landmarks,
                          double max_contradiction, SolvedMotion* out) {
  const MotionPrior& prior = given.prior;
  const WithoutAngles& own = landmarks.own;
  const Matrix4<double> telemetry_covariance = given.scaled.telemetry_information.inverse();
  out->innovation = given.scaled.telemetry.head<2>() - own.x.head<2>();
  out->innovation_covariance =
      telemetry_covariance.topLeftCorner<2, 2>() + own.covariance.topLeftCorner<2, 2>();
  out->innovation_covariance.diagonal() -= prior.error_variance + prior.repeated_variance;
  Matrix2<double> expected = out->innovation_covariance + landmarks.prior_offset;
  expected.diagonal() += prior.error_variance;
  Vector2<double> unexpected = out->innovation;
  if (prior.lens != nullptr) expect_of_lens(*prior.lens, own, &unexpected, &expected);
  if (given.problem.zooms()) {
    out->zoom.innovation_by_calibration =
        innovation_by_calibration(prior, own, landmarks.right_of_own);
    expected += out->zoom.innovation_by_calibration;
  }
  out->contradiction = unexpected.dot(inverse_of(expected) * unexpected);
  if (out->contradiction < max_contradiction) return true;
  out->innovation = unexpected;
  return false;
}

Posterior posterior_of_landmarks(const FromLandmarks& landmarks) {
  const WithoutAngles& own = landmarks.own;
  Posterior out;
  out.solution.head<6>() = own.x;
  out.sensitivity.topRows<6>() = own.covariance * landmarks.right_of_sensitivities;
  out.covariance.topLeftCorner<6, 6>() = own.covariance;
  out.covariance.bottomRightCorner<2, 2>() = landmarks.prior_offset;
  return out;
}

Posterior solve_with_offset(const Given& given, const FromLandmarks& landmarks) {
  JointEquations equations = joint_equations(given, landmarks);
  equations.all.bottomRightCorner<2, 2>() += inverse_of(equations.offset_covariance);
  return solved(Eigen::LDLT<Matrix8>(equations.all), equations);
}

bool solve_with_lens(const Given& given, const FromLandmarks& landmarks, Posterior* posterior,
                     MotionAndLens* x, SolvedMotion* out) {
  const MotionPrior& prior = given.prior;
  const ScaledPrior& scaled = given.scaled;
  const OrientationProblem& problem = given.problem;
  const WithoutAngles& own = landmarks.own;
  const LensScale* lens = prior.lens;
  JointEquations equations = joint_equations(given, landmarks);
  // Information of the prior of (g, phi).
  Matrix3<double> known;
  known << equations.offset_covariance, lens->covariance_with_offset,
      lens->covariance_with_offset.transpose(), lens->variance;
  known = known.inverse().eval();
  const Vector2<double> known_both = known.topRightCorner<2, 1>();
  equations.all.bottomRightCorner<2, 2>() += known.topLeftCorner<2, 2>();
  equations.right.tail<2>() += known_both * lens->value;
  Vector8 c;
  c << landmarks.right_of_sensitivities * lens->direction, -known_both;
  equations.sensitivity.bottomRows<2>() += known_both * lens->sensitivity;
  *posterior = solved(Eigen::LDLT<Matrix8>(equations.all), equations);

  Sensitivity<1> of_landmarks = problem.lens_row_of_sensitivities();
  if (problem.zooms()) {
    of_landmarks -=
        (landmarks.zoom.inverse * landmarks.zoom.c).transpose() * landmarks.zoom_of_sensitivities;
  }
  const Sensitivity<1> of_row = of_landmarks / landmarks.inflation +
                                (scaled.motion_information * scaled.motion_by_lens).transpose() *
                                    given.D.asDiagonal() * prior.motion_sensitivity;
  SolvedLens& solved_lens = out->lens;
  solved_lens.innovation_by_lens = own.by_lens.head<2>();
  solved_lens.information = own.information;
  if (own.information > 0) {
    solved_lens.measured = (own.row.b + own.row.c.dot(own.x)) / own.information;
    solved_lens.measured_sensitivity =
        (own.by_lens.transpose() * landmarks.right_of_own - of_row) / own.information;
  }
  // Removes the share that earlier frames said already.
  const double old = (1 - 1 / prior.scale_inflation) * own.information;
  const Vector8 by_lens = posterior->covariance * c;
  const double information = own.row.information - old + known(2, 2) - c.dot(by_lens);
  solved_lens.variance = 1 / information;
  solved_lens.value =
      solved_lens.variance * (own.row.b - old * solved_lens.measured + known(2, 2) * lens->value +
                              c.dot(posterior->solution));
  solved_lens.sensitivity = solved_lens.variance * (known(2, 2) * lens->sensitivity - of_row -
                                                    old * solved_lens.measured_sensitivity +
                                                    c.transpose() * posterior->sensitivity);
  solved_lens.motion_by_lens = by_lens.head<6>().cwiseQuotient(given.D);
  solved_lens.offset_by_lens = by_lens.tail<2>();
  const Vector6 at = posterior->solution.head<6>() + solved_lens.value * by_lens.head<6>();
  *x = {at, solved_lens.value, landmarks.zoom.at(at, solved_lens.value)};
  if (problem.zooms() && !solve_zoom(given, landmarks, *posterior, by_lens, &out->zoom))
    return false;
  return std::isfinite(solved_lens.value) && solved_lens.variance > 0 &&
         all_finite(solved_lens.sensitivity) && all_finite(by_lens);
}

}  // namespace alidade::internal
