#pragma once
// The sum of squares that a calibration minimises over the parameters, the trajectory p(t) and the
// landmarks, linearised:
//   sum rho(|A^-1 (u - pi(R(p(t + v l))^T d_b - nearness e_z))|^2 / sigma_px^2)   observations
// + sum rho(|wrap(measured - scale p(t'))|^2 / sigma_rad^2)                       telemetry
// + priors,        t' = t_telemetry - shift + drift (t_telemetry - reference).
// v is the row of u, l the line delay. A = I - l u' (0, 1) (Oth 18 to 21), u' the image motion in
// px/s: to first order, A^-1 e is the residual of the full rolling-shutter projection.
// Angles in rad, times in s on the image clock. Allocates. Derivation: docs/derivations.md.

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <functional>
#include <limits>
#include <vector>

#include "core/calibration/bordered_band.h"
#include "core/calibration/trajectory_spline.h"
#include "core/model/calibration.h"
#include "core/model/lens/zoom_law.h"

namespace alidade::internal {

// Local parameters: those of Parameter, then the drift between the two clocks. They are scaled so
// that their size hardly depends on the lens: log f, log aspect, distortion in the corner
// (zoom_law.h), centre offset (px), read-out time l h (s), h the image's height in rows. Changes of
// axes and landmarks are local (direction.h), in rad.
inline constexpr int kDrift = kParameterCount;
inline constexpr int kGlobalCount = kParameterCount + 1;
// The parameters before the scales act on observations: camera, line delay, axes.
inline constexpr int kObservedCount = index(Parameter::kPanScale);

using GlobalVector = Eigen::Matrix<double, kGlobalCount, 1>;
using GlobalMatrix = Eigen::Matrix<double, kGlobalCount, kGlobalCount>;

struct AdjustmentObservation {
  int landmark = 0;   // index into AdjustmentState::landmarks
  int frame = 0;      // index into AdjustmentData::frame_time_s
  Vector2<double> u;  // px, (u, v)
  double sigma = 1;   // px, of u and of v
  bool used = true;   // false: an outlier
};

struct AdjustmentTelemetry {
  double time_s = 0;                                // on the telemetry clock
  Vector2<double> measured;                         // rad, (pan, tilt)
  Vector2<double> sigma = Vector2<double>::Ones();  // rad; infinite: this axis is not measured
  // Whether an axis's residual shows the size of the noise. A rounding error's residual does not.
  std::array<bool, 2> is_noise = {true, true};
  bool used = true;
};

struct AdjustmentData {
  std::vector<double> frame_time_s;                 // of row 0, image clock
  std::vector<AdjustmentObservation> observations;  // sorted by landmark, then frame
  std::vector<AdjustmentTelemetry> telemetry;       // sorted by time
  double reference_s = 0;  // telemetry clock: the time at which the drift has no effect
};

struct AdjustmentState {
  Camera<double> camera;  // its distortion is unused, see corner_distortion
  CornerDistortion<double> corner_distortion = CornerDistortion<double>::Zero();
  double readout_s = 0;  // line delay times height, any sign
  Mechanics<double> mechanics;
  double shift_s = 0;  // telemetry clock = image clock + shift, at reference_s
  double drift = 0;    // s/s; the image clock gains this much on the telemetry clock
  TrajectorySpline trajectory;
  // Unit directions in the camera frame at the anchor's pan and tilt (rad). So landmarks turn with
  // the axes: in the base frame, far from zero pan, every change of an axis would be a large change
  // of all landmarks.
  PanTilt<double> anchor;
  std::vector<Vector3<double>> landmarks;
  // For each landmark: o / r, o the pupil's offset forward of the axes, r the landmark's distance,
  // minus the part that is common to all (it is in the focal length). Empty: all are 0.
  std::vector<double> nearness;

  // The camera with its distortion set from corner_distortion.
  [[nodiscard]] Camera<double> physical_camera() const;
  [[nodiscard]] double line_delay() const { return readout_s / camera.height; }  // s/row
};

// A Gaussian prior on each local parameter: mean and 1 / sigma^2. Information 0: no prior. Axes: in
// the tangent basis of the prior's axes.
struct AdjustmentPriors {
  AdjustmentState mean;  // its trajectory, landmarks and nearness are unused
  GlobalVector information = GlobalVector::Zero();
  // 1 / sigma^2 of a prior with mean 0 on each landmark's nearness; used only if the state has it.
  double nearness_information = 0;
};

// Cauchy: rho(x) = c^2 log(1 + x / c^2), x the squared norm of an error in units of its sigma. The
// scales c count sigmas; infinite scales give least squares.
struct LossScales {
  double pixel = std::numeric_limits<double>::infinity();
  double telemetry = std::numeric_limits<double>::infinity();
};

// The residual of one observation or sample at the current state: measured minus predicted (A^-1 e
// of an observation). J_angle: the derivative of the prediction by (pan, tilt). Both in units of
// sigma, times the square root of the robust weight.
struct LinearisedResidual {
  double time_s = 0;  // at which the trajectory is read
  int segment = 0;    // of the trajectory
  // False: an observation without projection; the other members mean nothing. Set for what is not
  // in use, too.
  bool valid = false;
  Vector2<double> error;
  Matrix2<double> J_angle;
};

using NormalMatrix = BorderedBand<kGlobalCount>;

struct Linearisation {
  // The whole sum, priors included. An observation in use without projection counts with a large
  // constant.
  double cost = 0;
  // False: an observation in use has no projection. Always true if LossScales::pixel is finite.
  bool valid = true;
  std::vector<LinearisedResidual> observations;  // by index in AdjustmentData
  std::vector<LinearisedResidual> telemetry;     // likewise

  // Normal equations H x = g: control points (two rows each), then the parameters.
  NormalMatrix H;
  NormalMatrix H_telemetry;  // the telemetry's part of H
  Eigen::VectorXd g;
  // A block for each landmark: H_ll, g_l, and the rows of H_cl for the touched control points and
  // for the first kObservedCount parameters. If the state has nearness, one block more for each
  // landmark follows (nearness_columns.h); only the first unknown of such a block counts, the
  // second is a dummy.
  std::vector<Matrix2<double>> H_landmark;
  std::vector<Vector2<double>> g_landmark;
  // Block l touches the control points touched[i], with H_touched[i], for i from touched_begin[l]
  // to before touched_begin[l + 1]. touched_begin has one element more than H_landmark.
  std::vector<std::size_t> touched_begin;
  std::vector<int> touched;
  std::vector<Matrix2<double>> H_touched;
  std::vector<Eigen::Matrix<double, kObservedCount, 2>> H_camera;
  // For each landmark c: if its nearness changes by s, its best direction changes by -c s. Empty:
  // the state has no nearness.
  std::vector<Vector2<double>> direction_by_nearness;
  // Number of nearness values that the observations, not the prior, determine; not whole.
  double nearness_unknowns = 0;
};

// The parameters' rows of H^-1, with landmarks eliminated; as many columns as H.
using GlobalRows = Eigen::Matrix<double, kGlobalCount, Eigen::Dynamic>;
// Change of the parameters per error of one observation; the error is in units of its sigma.
using Influence = Eigen::Matrix<double, kGlobalCount, 2>;

// d (prediction of a telemetry sample, in units of its sigma) / d (pan scale, tilt scale, shift,
// drift): the parameters from kObservedCount on. since_reference_s: sample.time_s - reference_s.
// angle, rate: of the trajectory at the sample, rad and rad/s.
using TelemetryJacobian = Eigen::Matrix<double, 2, kGlobalCount - kObservedCount>;
[[nodiscard]] TelemetryJacobian telemetry_jacobian(const Mechanics<double>& mechanics,
                                                   const AdjustmentTelemetry& sample,
                                                   double since_reference_s,
                                                   const Vector2<double>& angle,
                                                   const Vector2<double>& rate);

// An observation in use at a state, with everything on which departures from the model act
// (departure_score.h). error and J are in units of sigma, as in LinearisedResidual with least
// squares; each J is a derivative of the prediction.
struct ObservationRow {
  std::size_t index = 0;  // in AdjustmentData
  int landmark = 0;
  double time_s = 0;
  TrajectorySpline::Basis basis;
  Vector2<double> error;
  Matrix2<double> J_angle;
  Matrix2<double> J_landmark;
  Vector2<double> J_nearness;  // with the landmark's direction eliminated; 0 where there is none
  Eigen::Matrix<double, 2, kObservedCount> J_camera;
  Matrix2<double> whiten;       // A^-1 / sigma: from a displacement in px to units of sigma
  Vector3<double> d_c;          // to the landmark, as the pupil sees it; unit without nearness
  Matrix<double, 2, 3> J_u_dc;  // px
  Vector2<double> u_rate;       // px/s, of the landmark's image
};

// A telemetry sample in use, likewise.
struct TelemetryRow {
  std::size_t index = 0;  // in AdjustmentData
  double time_s = 0;
  TrajectorySpline::Basis basis;
  Vector2<double> error;
  Vector2<double> slope;  // derivative of each axis's prediction by its own angle: scale / sigma
  TelemetryJacobian J;
  Vector2<double> sigma;           // rad
  std::array<bool, 2> is_noise{};  // as in AdjustmentTelemetry
};

// Adds a solution of the normal equations to the state: x to trajectory and parameters, x_landmark
// to the landmarks' directions and, behind these, to their nearness, if there is any. A change of
// direction must include what goes with the nearness (direction_by_nearness), which
// Adjustment::solve() leaves out.
void apply_step(const Eigen::VectorXd& x, const std::vector<Vector2<double>>& x_landmark,
                AdjustmentState* state);

// Forms the normal equations; one object for each thread. The data must outlive it, and must not
// change between a linearisation and the calls that take it.
class Lineariser {
 public:
  Lineariser(const AdjustmentData& data, const AdjustmentPriors& priors,
             const std::array<bool, kGlobalCount>& fixed)
      : data_(data), priors_(priors), fixed_(fixed) {}

  // The parameter (index in GlobalVector) is fixed in all later calls of linearise().
  void hold(int parameter) { fixed_[static_cast<std::size_t>(parameter)] = true; }

  // Replaces all that *out holds, and reuses its memory.
  void linearise(const AdjustmentState& state, const LossScales& loss, Linearisation* out);

  // The influence of each observation; zero if it is not used. at: the linearisation at this state
  // with infinite loss scales. inverse: the parameters' rows of the inverse of at.H, landmarks
  // eliminated.
  [[nodiscard]] std::vector<Influence> influences(const AdjustmentState& state,
                                                  const Linearisation& at,
                                                  const GlobalRows& inverse) const;

  // Calls `observation` for each observation in use that has a projection, `telemetry` for each
  // sample in use. at: the linearisation at this state with infinite loss scales.
  void visit(const AdjustmentState& state, const Linearisation& at,
             const std::function<void(const ObservationRow&)>& observation,
             const std::function<void(const TelemetryRow&)>& telemetry) const;

 private:
  void add_observations(const AdjustmentState& state, const LossScales& loss, Linearisation* out);
  void add_telemetry(const AdjustmentState& state, const LossScales& loss, Linearisation* out);
  void add_priors(const AdjustmentState& state, Linearisation* out) const;
  void fix_parameters(Linearisation* out) const;

  const AdjustmentData& data_;
  AdjustmentPriors priors_;
  std::array<bool, kGlobalCount> fixed_;
  std::vector<Matrix2<double>> touched_buffer_;
  std::vector<char> is_touched_;
};

}  // namespace alidade::internal
