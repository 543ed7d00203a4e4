#pragma once
// The last step of a frame's solution: landmarks, telemetry and priors together. Unknowns: the
// motion x, the map's offset g and, if the focal length is learnt, phi with the frame's own lens.
// Times are in units of half the read-out. Internal to orientation_solve.cpp. No allocation.

#include "core/realtime/oe_mode/orientation_without_angles.h"

namespace alidade::internal {

using Matrix8 = Matrix<double, 8, 8>;
using Vector8 = Matrix<double, 8, 1>;

// What the landmarks within the gate give, without telemetry's angles.
struct FromLandmarks {
  const double* weights = nullptr;  // by landmark: 1 within the gate, else 0
  double inflation = 1;             // factor for the landmarks' covariances
  WithoutAngles own;
  Matrix2<double> prior_offset =
      Matrix2<double>::Zero();  // rad^2, of g: its prior's and the landmarks' common error
  ZoomRows zoom;                // this and the next: only if the frame has its own lens
  Sensitivity<2> zoom_of_sensitivities = Sensitivity<2>::Zero();
  // Change of the right-hand side of x with the parameters; right_of_own: telemetry's rates
  // included, only with a learnt lens.
  Sensitivity<6> right_of_sensitivities;
  Sensitivity<6> right_of_own = Sensitivity<6>::Zero();
};

// The problem with its prior and scaling.
struct Given {
  const OrientationProblem& problem;
  const MotionPrior& prior;
  const ScaledPrior& scaled;
  const Vector6& D;  // scaled = D unscaled
  double unit_s;
};

// Solution of (x, g), scaled; at phi = 0 if the lens is learnt.
struct Posterior {
  Vector8 solution = Vector8::Zero();
  Matrix8 covariance = Matrix8::Zero();
  Sensitivity<8> sensitivity = Sensitivity<8>::Zero();
};

// weights, and the landmarks' `inlier`: by gate(). *shared: rad^2, the landmarks' common error.
[[nodiscard]] FromLandmarks sums_of_landmarks(const Given& given, const FoundLandmark* landmarks,
                                              const double* weights, double inflation,
                                              Matrix2<double>* shared);

// Telemetry's angles against the landmarks'. Needs telemetry. Writes the innovation, its covariance
// and the contradiction. False: they exclude each other; out->innovation then lacks what phi
// explains.
[[nodiscard]] bool agree_with_telemetry(const Given& given, const FromLandmarks& landmarks,
                                        double max_contradiction, SolvedMotion* out);

// Without telemetry's angles and without a learnt lens: the landmarks' own solution.
[[nodiscard]] Posterior posterior_of_landmarks(const FromLandmarks& landmarks);
// For a frame with telemetry, and without a learnt lens.
[[nodiscard]] Posterior solve_with_offset(const Given& given, const FromLandmarks& landmarks);
// For a learnt lens. Writes out->lens and out->zoom, and *x at the value of phi. False if a result
// is not finite.
[[nodiscard]] bool solve_with_lens(const Given& given, const FromLandmarks& landmarks,
                                   Posterior* posterior, MotionAndLens* x, SolvedMotion* out);

}  // namespace alidade::internal
