#pragma once
// The sum of squares that a calibration minimises, linearised: over the parameters, the trajectory
// and the landmarks
//   sum rho(|A^-1 (u - pi(R(p(t + v l))^T d_b))|^2 / sigma_px^2)         one observation (u, v)
// + sum rho(|wrap(measured - scale p(t'))|^2 / sigma_rad^2)              one telemetry sample
// + priors,        t' = t_telemetry - shift + drift (t_telemetry - reference).
// A is the row-time effect of (Oth 18 to 21); A^-1 e is the residual of the full rolling-shutter
// projection.
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
// that every lens is equally easy: log f, log alpha, distortion in the corner (zoom_law.h), centre
// offset (px), read-out time l h. Changes of axes and landmarks are local (direction.h).
inline constexpr int kDrift = kParameterCount;
inline constexpr int kGlobalCount = kParameterCount + 1;
// The parameters before the scales act on observations: camera, line delay, axes.
inline constexpr int kObservedCount = index(Parameter::kPanScale);

using GlobalVector = Eigen::Matrix<double, kGlobalCount, 1>;
using GlobalMatrix = Eigen::Matrix<double, kGlobalCount, kGlobalCount>;

struct AdjustmentObservation {
  int landmark = 0;
  int frame = 0;
  Vector2<double> u;
  double sigma = 1;  // px
  bool used = true;  // false: an outlier
};

struct AdjustmentTelemetry {
  double time_s = 0;  // on the telemetry clock
  Vector2<double> measured;
  Vector2<double> sigma = Vector2<double>::Ones();  // rad; infinite: this axis is not measured
  // Whether an axis's residual shows the size of the noise. That of a rounding error does not.
  std::array<bool, 2> is_noise = {true, true};
  bool used = true;
};

struct AdjustmentData {
  std::vector<double> frame_time_s;
  std::vector<AdjustmentObservation> observations;  // sorted by landmark, then frame
  std::vector<AdjustmentTelemetry> telemetry;       // sorted by time
  double reference_s = 0;                           // time at which the drift has no effect
};

struct AdjustmentState {
  Camera<double> camera;  // its distortion is unused, see corner_distortion
  CornerDistortion<double> corner_distortion = CornerDistortion<double>::Zero();
  double readout_s = 0;  // line delay times height
  Mechanics<double> mechanics;
  double shift_s = 0;
  double drift = 0;
  TrajectorySpline trajectory;
  // In the camera frame at the anchor's pan and tilt, so that landmarks turn with the axes.
  // Otherwise, far from zero pan, every change of an axis would be a large change of all landmarks.
  PanTilt<double> anchor;
  std::vector<Vector3<double>> landmarks;
  // Of each landmark: the pupil's place before the axes over the landmark's distance, less what all
  // have in common, which is part of the focal length. d_c is nearer by it. Empty: none has any.
  std::vector<double> nearness;

  [[nodiscard]] Camera<double> physical_camera() const;
  [[nodiscard]] double line_delay() const { return readout_s / camera.height; }
};

// A Gaussian prior on each local parameter; information 0: none. Axes: in the tangent basis of the
// prior's axes.
struct AdjustmentPriors {
  AdjustmentState mean;  // its trajectory and landmarks are unused
  GlobalVector information = GlobalVector::Zero();
  double nearness_information = 0;  // of each landmark, about 0; where the state has it
};

// Cauchy: rho(x) = c^2 log(1 + x / c^2). Infinite scales give least squares.
struct LossScales {
  double pixel = std::numeric_limits<double>::infinity();
  double telemetry = std::numeric_limits<double>::infinity();
};

// Residual e of one observation or sample at the current state, and its derivative by (pan, tilt).
// Both in units of sigma, times the square root of the robust weight.
struct LinearisedResidual {
  double time_s = 0;
  int segment = 0;
  bool valid = false;
  Vector2<double> error;
  Matrix2<double> J_angle;
};

using NormalMatrix = BorderedBand<kGlobalCount>;

struct Linearisation {
  double cost = 0;    // sum of rho
  bool valid = true;  // every used observation has a projection
  std::vector<LinearisedResidual> observations;
  std::vector<LinearisedResidual> telemetry;

  // Normal equations H x = g: control points (two rows each), then the parameters.
  NormalMatrix H;
  NormalMatrix H_telemetry;  // the telemetry's part of H
  Eigen::VectorXd g;
  // Landmarks: H_ll, g_l, and rows of H_cl for the touched control points and the camera. Where the
  // state has nearness, as many follow again: that of each, with its direction eliminated (the
  // second unknown of these is none).
  std::vector<Matrix2<double>> H_landmark;
  std::vector<Vector2<double>> g_landmark;
  std::vector<std::size_t> touched_begin;  // into the two below; one more than landmarks
  std::vector<int> touched;
  std::vector<Matrix2<double>> H_touched;
  std::vector<Eigen::Matrix<double, kObservedCount, 2>> H_camera;
  // By each landmark's nearness; empty: none. Its direction's best change, negative.
  std::vector<Vector2<double>> direction_by_nearness;
  double nearness_unknowns = 0;  // number that the observations determine
};

// The parameters' rows of H^-1, with landmarks eliminated; as many columns as H.
using GlobalRows = Eigen::Matrix<double, kGlobalCount, Eigen::Dynamic>;
// Change of the parameters with the error of one observation, in units of its sigma.
using Influence = Eigen::Matrix<double, kGlobalCount, 2>;

// d (prediction of a telemetry sample, in units of its sigma) / d (pan scale, tilt scale, shift,
// drift), which are the last parameters.
using TelemetryJacobian = Eigen::Matrix<double, 2, kGlobalCount - kObservedCount>;
[[nodiscard]] TelemetryJacobian telemetry_jacobian(const Mechanics<double>& mechanics,
                                                   const AdjustmentTelemetry& sample,
                                                   double since_reference_s,
                                                   const Vector2<double>& angle,
                                                   const Vector2<double>& rate);

// An observation in use at a state, with what departures from the model act on
// (departure_score.h). Derivatives are of the projection, in units of sigma.
struct ObservationRow {
  std::size_t index = 0;
  int landmark = 0;
  double time_s = 0;
  TrajectorySpline::Basis basis;
  Vector2<double> error;
  Matrix2<double> J_angle;
  Matrix2<double> J_landmark;
  Vector2<double> J_nearness;  // with the landmark's direction eliminated; 0 where there is none
  Eigen::Matrix<double, 2, kObservedCount> J_camera;
  Matrix2<double> whiten;  // A^-1 / sigma: from a displacement in px to units of sigma
  Vector3<double> d_c;
  Matrix<double, 2, 3> J_u_dc;  // px
  Vector2<double> u_rate;       // px/s, of the landmark's image
};

// A telemetry sample in use, likewise.
struct TelemetryRow {
  std::size_t index = 0;
  double time_s = 0;
  TrajectorySpline::Basis basis;
  Vector2<double> error;
  Vector2<double> slope;  // derivative by (pan, tilt), of either axis
  TelemetryJacobian J;
  Vector2<double> sigma;           // rad
  std::array<bool, 2> is_noise{};  // as in AdjustmentTelemetry
};

// x_landmark: the changes of directions, then those of nearness, if there is any.
void apply_step(const Eigen::VectorXd& x, const std::vector<Vector2<double>>& x_landmark,
                AdjustmentState* state);

// Forms the normal equations; one object for each thread. The data must outlive it.
class Lineariser {
 public:
  Lineariser(const AdjustmentData& data, const AdjustmentPriors& priors,
             const std::array<bool, kGlobalCount>& fixed)
      : data_(data), priors_(priors), fixed_(fixed) {}

  // As if it had been fixed from the start.
  void hold(int parameter) { fixed_[static_cast<std::size_t>(parameter)] = true; }

  // Replaces all that *out holds, and reuses its memory.
  void linearise(const AdjustmentState& state, const LossScales& loss, Linearisation* out);

  // Of each observation; zero if it is not used. at: least squares at this state. inverse: rows of
  // its H^-1.
  [[nodiscard]] std::vector<Influence> influences(const AdjustmentState& state,
                                                  const Linearisation& at,
                                                  const GlobalRows& inverse) const;

  // Calls either function for each observation and each sample in use. at: least squares at this
  // state.
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
