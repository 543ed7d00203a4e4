#pragma once
// The orientation of one frame from landmarks found in it, with telemetry as prior (PTCEE 35, and beyond).
//
//   x = (angle, rate, acceleration) of pan and tilt at the reference row, in the map's frame,
//   g = (pan, tilt) offset, base minus map
//   landmarks:  found - predicted = J (dx_angle + t dx_rate + t^2/2 dx_acceleration) + noise, t the row's time
//   telemetry:  angle = x_angle + g, rate = x_rate;   accelerations are small;   g is known from before
//
// Robust: from the component-wise median of what each landmark alone would say, weights fall with the
// residual (Geman-McClure), the scale going down to what the residuals show; then those within the gate
// count fully and the rest not at all. Up to half of the landmarks may be wrong.
// Covariance: of the linear problem, times how much larger the residuals are than claimed, one by one
// and averaged over neighbours (a tenth of the image), which finds errors that neighbours share; plus the
// shared covariance of the landmarks themselves, averaged with their weights.
// The calibration is taken as exact; how the solution depends on it follows from how the residuals and the
// prior do (Sensitivity): the linear problem once more, with these on the right-hand side.
// Where the focal length is learnt (lens_scale.h) phi joins the unknowns, known from before as g is, with which it is correlated:
//   found - predicted + s phi = J (...) + noise,   s = d (found - predicted) / d phi
// Corrections and their covariances are then those at phi = 0, and SolvedLens tells what phi is and makes of them.
// Where the lens has moved since the map was made, or moves (frame_lens.h), the frame's own lens joins them, l = (log f, its rate):
//   found - predicted + s phi = J (...) + z (dl_0 + t dl_1) + noise,   z = d u / d log f of the frame's camera
// It is eliminated first, with what is known of it before the frame as prior. The offset has taken up what the calibration errs by at
// the map's zoom: c px of the optical centre are c / f there, and something else here. Landmarks and telemetry exclude each other
// where they do so beyond that, too.
// Pure functions; no allocation.

#include <array>

#include "core/model/angle.h"
#include "core/model/calibration.h"
#include "core/realtime/oe_mode/covariance.h"
#include "core/realtime/oe_mode/lens_scale.h"

namespace alidade {

// Of one frame; more are not looked at.
inline constexpr int kMaxFoundLandmarks = 1024;

// One landmark that was found.
struct FoundLandmark {
  Vector2<double> u;           // px, where
  Vector2<double> residual;    // px, found minus predicted
  Matrix2<double> J_angle;     // px/rad, see SeenDirection
  double time_s;               // of its row, after the reference row
  Matrix2<double> covariance;  // px^2, of the residual by noise and by the landmark's own direction
  Matrix2<double> shared_covariance;                    // rad^2, of (pan, tilt), see Landmark
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();  // px/unit, of the residual
  Vector2<double> by_zoom = Vector2<double>::Zero();    // px, z above; where the prior has a zoom
  double normalised_square = 0;  // out: residual after the solution, by covariance
  bool inlier = false;           // out
};

// Of (log f, its rate in 1/s) of the frame's lens, at phi = 0, without its landmarks.
struct ZoomPrior {
  Vector2<double> value = Vector2<double>::Zero();  // expected minus predicted
  Matrix2<double> covariance = Matrix2<double>::Identity();
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();
  // Of the calibration's errors at this zoom, beside those that it shares with the map's lens; for the map's columns.
  ParameterDirection own_variances = ParameterDirection::Zero();
};

// What is known without landmarks, relative to the motion the residuals were predicted with.
struct MotionPrior {
  bool has_telemetry = false;
  Vector4<double> telemetry =
      Vector4<double>::Zero();  // measured minus (predicted + offset), true units
  Matrix4<double> telemetry_covariance = Matrix4<double>::Zero();
  Sensitivity<4> telemetry_sensitivity = Sensitivity<4>::Zero();
  // Of g, before this frame, rad^2.
  Matrix2<double> offset_covariance = Matrix2<double>::Zero();
  // Of (angle, rate) from the frames before, and of acceleration; information, as some know nothing.
  Vector6 motion = Vector6::Zero();  // expected minus predicted
  Matrix6 motion_information = Matrix6::Zero();
  Sensitivity<6> motion_sensitivity = Sensitivity<6>::Zero();
  const LensScale* lens = nullptr;  // before this frame; null: not learnt
  // Of the variance of what the landmarks' scale says of phi, which frames before said already; >= 1.
  double scale_inflation = 1;
  const ZoomPrior* zoom = nullptr;  // null: the lens is the map's; needs `lens`
};

enum class SolveStatus {
  kOk,
  kTooFew,         // inliers
  kContradiction,  // of landmarks and telemetry
  kNotFinite
};

// Of a learnt focal length, all known together.
struct SolvedLens {
  double value = 0;     // phi
  double variance = 0;  // of its noise
  Sensitivity<1> sensitivity = Sensitivity<1>::Zero();
  // A unit of phi adds to correction, to offset_correction, and takes from the innovation.
  Vector6 motion_by_lens = Vector6::Zero();
  Vector2<double> offset_by_lens = Vector2<double>::Zero();
  Vector2<double> innovation_by_lens = Vector2<double>::Zero();
  // What the landmarks' scale alone says of phi; information 0: nothing.
  double measured = 0;
  double information = 0;
  Sensitivity<1> measured_sensitivity = Sensitivity<1>::Zero();
};

// Of the frame's lens, beside phi.
struct SolvedZoom {
  Vector2<double> correction = Vector2<double>::Zero();  // of what was predicted, at phi = 0
  Matrix2<double> covariance = Matrix2<double>::Zero();
  Sensitivity<2> sensitivity = Sensitivity<2>::Zero();
  Vector2<double> by_lens = Vector2<double>::Zero();  // a unit of phi adds to it
  // rad^2, of the innovation: errors of the calibration at this zoom, which the offset has learnt nothing of.
  Matrix2<double> innovation_by_calibration = Matrix2<double>::Zero();
};

struct SolvedMotion {
  Vector6 correction = Vector6::Zero();  // of the predicted motion, map frame
  // Of g, in this frame: what its landmarks share is in it.
  Vector2<double> offset_correction = Vector2<double>::Zero();
  Matrix6 covariance = Matrix6::Zero();        // of x + g (base)
  Matrix6 frame_covariance = Matrix6::Zero();  // of x (map), by this frame's noise alone
  Matrix2<double> shared_covariance = Matrix2<double>::Zero();  // of angles, by the landmarks used
  Sensitivity<6> sensitivity = Sensitivity<6>::Zero();          // of correction
  Sensitivity<2> offset_correction_sensitivity = Sensitivity<2>::Zero();  // of offset_correction
  SolvedLens lens;                                                        // where it is learnt
  SolvedZoom zoom;                                                        // where the prior has one
  int inliers = 0;
  double inflation = 1;      // of the landmarks' covariances
  double contradiction = 0;  // chi-square, 2 degrees of freedom, of landmarks against telemetry
  // rad, telemetry's angles minus landmarks', without the offset known before; and rad^2, how well both
  // know them, apart from g and from what the landmarks share.
  Vector2<double> innovation = Vector2<double>::Zero();
  Matrix2<double> innovation_covariance = Matrix2<double>::Zero();
};

struct SolveLimits {
  int min_inliers = 8;
  double min_inlier_share = 0.3;
  double max_contradiction = 36;  // chi-square
  double max_scale = 30;  // by which residuals may exceed what is claimed, standard deviations
  double min_half_readout_s = 1e-3;
};

// width, height: px, of the image; half_readout_s: scale of the rows' times.
[[nodiscard]] SolveStatus solve_orientation(FoundLandmark* landmarks, int count,
                                            const MotionPrior& prior, const SolveLimits& limits,
                                            double width, double height, double half_readout_s,
                                            SolvedMotion* out);

}  // namespace alidade
