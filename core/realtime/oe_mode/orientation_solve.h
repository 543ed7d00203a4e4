#pragma once
// Solves the orientation of one frame from landmarks found in it, with telemetry as prior (PTCEE
// 35, and beyond). Unknowns: x = (angle, rate, acceleration) of pan and tilt at the reference row,
// map's frame; g = (pan, tilt) offset, base minus map.
//   found - predicted = J (dx_angle + t dx_rate + t^2/2 dx_acceleration) + noise, t the row's time
//   telemetry's angle = x_angle + g,   its rate = x_rate
// Priors: small accelerations, g from earlier frames. A learnt focal length adds phi (LensScale), a
// lens that has moved its own l (ZoomPrior). The calibration counts as exact; Sensitivity carries
// the dependence on it. Pure; no allocation. Derivation: docs/oe_mode.md.

#include <array>

#include "core/model/angle.h"
#include "core/model/calibration.h"
#include "core/realtime/lens/own_lens.h"
#include "core/realtime/oe_mode/covariance.h"
#include "core/realtime/oe_mode/lens_scale.h"

namespace alidade {

// Landmarks of one frame; more are ignored, and their outputs are not written.
inline constexpr int kMaxFoundLandmarks = 1024;

// One found landmark.
struct FoundLandmark {
  Vector2<double> u;           // px, found position
  Vector2<double> residual;    // px, found minus predicted
  Matrix2<double> J_angle;     // px/rad, see SeenDirection
  double time_s;               // s, of its row after the reference row
  Matrix2<double> covariance;  // px^2, of the residual, from noise and the landmark's own direction
  Matrix2<double> shared_covariance;                    // rad^2, of (pan, tilt), see Landmark
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();  // px/unit, of the residual
  Vector2<double> by_zoom = Vector2<double>::Zero();    // px, z of ZoomPrior, if there is one
  double normalised_square =
      0;                // out: squared residual after the solution, divided by its covariance
  bool inlier = false;  // out
};

// Knowledge without landmarks, relative to the motion with which the residuals were predicted.
struct MotionPrior {
  bool has_telemetry = false;
  Vector4<double> telemetry =
      Vector4<double>::Zero();  // measured minus (predicted + offset), true units
  Matrix4<double> telemetry_covariance = Matrix4<double>::Zero();
  // rad^2, parts of telemetry_covariance: that of an error that depends on the angle, and what is
  // added for knowing that error from before (AngleErrorShare). The innovation's covariance has
  // neither.
  Vector2<double> error_variance = Vector2<double>::Zero();
  Vector2<double> repeated_variance = Vector2<double>::Zero();
  Sensitivity<4> telemetry_sensitivity = Sensitivity<4>::Zero();
  // rad^2, of g, before this frame.
  Matrix2<double> offset_covariance = Matrix2<double>::Zero();
  // Prior of (angle, rate) from the previous frames, and of acceleration. Its information may be 0.
  Vector6 motion = Vector6::Zero();  // expected minus predicted
  Matrix6 motion_information = Matrix6::Zero();
  Sensitivity<6> motion_sensitivity = Sensitivity<6>::Zero();
  const LensScale* lens = nullptr;  // before this frame; null: not learnt
  // >= 1; factor for the variance of phi from this frame's landmarks, as part of their error was in
  // earlier frames, too.
  double scale_inflation = 1;
  const ZoomPrior* zoom = nullptr;  // null: the lens is the map's. Needs `lens`.
  // >= 1; factor for the covariances of landmarks, beyond what they scatter singly, as neighbours
  // share errors (ErrorSharing).
  double sharing = 1;
};

// Squares of residuals, relative to what independent errors with the claimed covariances leave.
struct ResidualSquares {
  double sum = 0;
  double freedom = 0;  // degrees
};
// Averages of both components, by cell.
inline constexpr std::size_t kLargeCellCount = 6;
using LargeAverages = std::array<double, 2 * kLargeCellCount>;

enum class SolveStatus {
  kOk,
  kTooFew,         // landmarks or inliers
  kContradiction,  // between landmarks and telemetry
  kNotFinite
};

// Solution of a learnt focal length, from everything known. phi is an unknown like g, and
// correlated with it:
//   found - predicted + s phi = J (...) + noise,   s = d (found - predicted) / d phi
// Corrections and their covariances in SolvedMotion are those at phi = 0.
struct SolvedLens {
  double value = 0;     // phi
  double variance = 0;  // of its noise
  Sensitivity<1> sensitivity = Sensitivity<1>::Zero();
  // Change per unit of phi of correction and of offset_correction; innovation_by_lens: of the
  // expected innovation.
  Vector6 motion_by_lens = Vector6::Zero();
  Vector2<double> offset_by_lens = Vector2<double>::Zero();
  Vector2<double> innovation_by_lens = Vector2<double>::Zero();
  // phi from the landmarks' scale alone. information 0: nothing.
  double measured = 0;
  double information = 0;
  Sensitivity<1> measured_sensitivity = Sensitivity<1>::Zero();
};

struct SolvedMotion {
  Vector6 correction = Vector6::Zero();  // of the predicted motion, map's frame
  // rad, of g in this frame, including the common error of its landmarks.
  Vector2<double> offset_correction = Vector2<double>::Zero();
  Matrix6 covariance = Matrix6::Zero();        // of x + g (base)
  Matrix6 frame_covariance = Matrix6::Zero();  // of x (map), from this frame's noise alone
  Matrix2<double> shared_covariance =
      Matrix2<double>::Zero();  // rad^2, of angles, from the landmarks' common error
  Sensitivity<6> sensitivity = Sensitivity<6>::Zero();                    // of correction
  Sensitivity<2> offset_correction_sensitivity = Sensitivity<2>::Zero();  // of offset_correction
  SolvedLens lens;                                                        // if it is learnt
  SolvedZoom zoom;                                                        // if the prior has a zoom
  int inliers = 0;
  double inflation = 1;  // of the landmarks' covariances, without MotionPrior::sharing
  // The inliers' residuals, and their averages over sixths of the image; these also one by one, in
  // standard deviations, 0 for a sixth without landmarks.
  ResidualSquares single_squares;
  ResidualSquares large_squares;
  LargeAverages large_averages{};
  double contradiction = 0;  // chi-square, 2 degrees of freedom: landmarks against telemetry
  // Innovation: rad, telemetry's angles minus landmarks', without the earlier offset. Its
  // covariance: rad^2, without g and without the landmarks' common error.
  Vector2<double> innovation = Vector2<double>::Zero();
  Matrix2<double> innovation_covariance = Matrix2<double>::Zero();
};

struct SolveLimits {
  int min_inliers = 8;            // >= 1; with fewer there is no solution
  double min_inlier_share = 0.3;  // 0 to 1, of the found landmarks
  // Chi-square, 2 degrees of freedom, > 0; beyond it landmarks and telemetry exclude each other.
  double max_contradiction = kMaxContradiction;
  double max_scale = 30;  // >= 1; largest factor of residuals over their standard deviation
  double min_half_readout_s = 1e-3;  // s, > 0; least unit of time, for a lens without read-out

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// width, height: px, of the image. half_readout_s: s, any sign; scale of the rows' times.
// Robust (orientation_inliers.h): up to half of the landmarks may be wrong. *out and the landmarks'
// outputs are complete with kOk. With kContradiction *out has the squares, the landmarks' common
// error and the innovation, which then lacks what phi explains; no correction. With other statuses
// *out must not be used. Covariance: that of the linear problem, times prior.sharing and the factor
// by which squares of residuals exceed their covariances: the larger one of single residuals and of
// averages within a tenth of the image's width, which reveal common errors. The landmarks' shared
// covariance is added.
[[nodiscard]] SolveStatus solve_orientation(FoundLandmark* landmarks, int count,
                                            const MotionPrior& prior, const SolveLimits& limits,
                                            double width, double height, double half_readout_s,
                                            SolvedMotion* out);

}  // namespace alidade
