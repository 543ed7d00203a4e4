#pragma once
// Input, options and result of calibrate(). Plain values. Angles rad, times s, pixels as in
// CONVENTIONS.md. Telemetry clock = image clock + clock_offset.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibration_goals.h"
#include "core/calibration/trajectory_spline.h"
#include "core/model/calibration.h"
#include "core/model/pupil.h"
#include "core/model/telemetry_error.h"

namespace alidade {

struct CalibrationFrame {
  std::int64_t frame = 0;                // the name that observations use
  double stamp_s = 0;                    // image clock; of row 0, jitter included
  std::optional<std::int64_t> sequence;  // the sender's count, which includes lost frames
};

struct CalibrationObservation {
  std::int64_t frame = 0;     // name, as in CalibrationFrame
  std::int64_t landmark = 0;  // name; the same in all frames that see the landmark
  double u_px = 0;
  double v_px = 0;
  double sigma_px = 0;  // of u and of v; > 0
};

struct CalibrationTelemetry {
  double stamp_s = 0;  // telemetry clock
  double pan_rad = 0;  // as measured, wrapped or not; beyond +-2.5 pi the input is refused
  double tilt_rad = 0;
  std::optional<std::int64_t> sequence;  // the sender's count, which includes lost samples
};

// Standard deviations of the noise, and the periods of the streams' clocks. A value that is not
// given is estimated from the data; so is a sigma of stamps or angles that the data contradict
// beyond chance. A period without its sigma is only used to count the stream's ticks.
struct CalibrationNoise {
  std::optional<double> image_stamp_sigma_s;
  std::optional<double> image_period_s;
  std::optional<double> image_period_sigma_s;
  std::optional<double> telemetry_stamp_sigma_s;
  std::optional<double> telemetry_period_s;
  std::optional<double> telemetry_period_sigma_s;
  std::optional<double> pan_tilt_sigma_rad;
  // Standard deviation of an error that all telemetry stamps share, in addition to each stamp's
  // own. Averaging over samples does not reduce its effect on the clock offset.
  double telemetry_common_sigma_s = 0;
};

struct CalibrationInput {
  int width = 0;   // px
  int height = 0;  // px
  std::vector<CalibrationFrame> frames;
  std::vector<CalibrationObservation> observations;
  std::vector<CalibrationTelemetry> telemetry;
  CalibrationNoise noise;
};

// In the unit of its parameter. sigma 0: known exactly.
struct CalibrationPrior {
  double value = 0;
  double sigma = 0;
};

// Error model of a stream's time stamps.
enum class StampNoise {
  kSymmetric,  // zero mean
  kOneSided,   // never early: stamped after a network or in software
  kOwnTimes    // polled: taken at about the stamped time, without a steady clock
};

struct CalibrationOptions {
  std::optional<CalibrationPrior> focal_length;  // px
  std::optional<CalibrationPrior> aspect = CalibrationPrior{1, 0};
  std::optional<CalibrationPrior> radial_distortion;  // k, no unit
  // Prior of the optical centre's offset from the image's middle. At one zoom this offset can
  // hardly be distinguished from a turn of the axes: the sigmas of centre and axes include this
  // doubt.
  Vector2<double> centre_offset_px = Vector2<double>::Zero();
  double centre_sigma_px = 0;                    // each component; 0: known exactly
  std::optional<CalibrationPrior> line_delay;    // s/row
  std::optional<CalibrationPrior> clock_offset;  // s
  CalibrationPrior pan_scale = {1, 1e-8};
  CalibrationPrior tilt_scale = {1, 1e-8};
  // Where the recording shows that pan and tilt differ in scale, by 2 % at most, both scales are
  // learnt, each with the sigma that makes their difference likeliest. A larger difference is
  // refused. False: the priors hold, as for a zoom curve, all of whose nodes need the same ones.
  bool learns_scales = true;
  Vector3<double> pan_axis = Vector3<double>::UnitZ();   // base; normalised before use
  Vector3<double> tilt_axis = Vector3<double>::UnitY();  // likewise
  double axis_sigma_rad = 0.05;  // of both axes, each tangent component; 0: known exactly
  // The accuracy that the maker claims for the angles of each axis: one standard deviation of
  // errors that vary slowly over the whole visited range. The recording cannot show such errors, as
  // they look like a scale. 0: no claim; the priors of the scales hold as they are.
  double angle_accuracy_rad = 0;
  // A pupil before the axes makes near things look larger, which no residual shows if all are
  // equally near. The focal length is that of what is in view. Its sigma also covers far things if
  // a scene is stated or the pictures show different distances.
  Pupil pupil;
  std::optional<SceneDistance> scene;

  StampNoise image_stamps = StampNoise::kSymmetric;
  StampNoise telemetry_stamps = StampNoise::kSymmetric;
  // Half the range that is searched first, about the prior's offset or 0. It is doubled while the
  // best offset is at its edge.
  double clock_offset_search_s = 1;
  double first_knot_spacing_s = 0.5;  // of the trajectory, before the residuals ask for more knots
  int max_knots = 2000;               // the trajectory is not split into this many segments or more

  // Called between stages with the progress (0 to 1) and a few words. Returning false cancels.
  std::function<bool(double, const char*)> progress;

  // False and one line in *error (if not null) when a value is out of its range.
  [[nodiscard]] bool validate(std::string* error = nullptr) const;

  // Prior standard deviation of a parameter, in its unit. 0: known exactly. Empty: no prior.
  [[nodiscard]] std::optional<double> prior_sigma(Parameter parameter) const;
};

enum class CalibrationStatus {
  kOk,
  kBadInput,          // input or options cannot be used; message says what is wrong
  kNoMotion,          // too little for anything
  kOneAxisOnly,       // pan only or tilt only
  kConstantVelocity,  // clock offset and line delay unknown
  kTooFewLandmarks,
  kTelemetryMismatch,  // telemetry does not describe the video's motion
  kNotConverged,
  kWeak,      // a parameter is undetermined, or too uncertain to be published
  kCancelled  // by progress()
};

[[nodiscard]] const char* to_string(CalibrationStatus status);

// One stream's clock, fitted as a line through its stamps.
struct StreamTiming {
  bool steady = false;  // false: the stamps fit no steady period and are used as they are
  double period_s = 0;  // this and the next two: 0 if not steady
  double period_sigma_s = 0;
  double offset_sigma_s = 0;  // of the line at its middle
  double stamp_sigma_s = 0;   // of one stamp about the line
  int lost = 0;               // ticks of the clock that have no stamp
};

// Counts of what was left out, by reason.
struct CalibrationExclusions {
  int frames_not_finite = 0;
  int frames_duplicate = 0;
  int frames_without_telemetry = 0;  // outside the telemetry's time span
  int observations_not_finite = 0;
  int observations_bad_sigma = 0;
  int observations_outside_image = 0;
  int observations_duplicate = 0;
  int observations_unknown_frame = 0;
  int observations_of_single_landmarks = 0;  // a landmark seen once shows nothing
  int observations_outliers = 0;
  int observations_drifting = 0;  // of what drifts against the telemetry: clouds, water, traffic
  int telemetry_not_finite = 0;
  int telemetry_duplicate = 0;
  int telemetry_outliers = 0;
  int telemetry_unused = 0;  // more than 0.25 s before or after the video

  // One line for each kind that occurred.
  [[nodiscard]] std::vector<std::string> describe() const;
};

struct CalibrationLandmark {
  std::int64_t landmark = 0;  // name, as in CalibrationObservation
  Vector3<double> d_b;        // unit direction, base
  // rad^2, in tangent_basis(d_b). From the landmark's own observations, with camera and trajectory
  // taken as known.
  Matrix2<double> covariance = Matrix2<double>::Zero();
  int observations = 0;  // that were used, two or more
};

struct FrameResult {
  std::int64_t frame = 0;
  double time_s = 0;      // image clock, row 0
  PanTilt<double> angle;  // true angles at that time, rad
  PanTilt<double> rate;   // rad/s
};

// Seen minus projected (A^-1 e of linearisation.h). Its standard deviation is the observation's
// sigma_px if the stated noise is right. An outlier without a projection has none.
struct ObservationResidual {
  std::size_t observation = 0;  // index into the input
  Vector2<double> error_px;
  bool outlier = false;
};
// Telemetry with a coarse angle resolution gives one more item for each change of a reading by one
// step. Its time is the middle of the two samples' times, when the angle passed half-way between
// the readings. Its error is NaN for an axis that did not change so.
struct TelemetryResidual {
  std::size_t sample = 0;     // index into the input
  double time_s = 0;          // image clock
  Vector2<double> error_rad;  // measured, less telemetry_error, minus predicted
  Vector2<double> sigma_rad;  // as used; infinite where rounding, not noise, makes the error
  bool outlier = false;
};

// Parts of the recording disagree in a parameter by more than chance. The parameter's sigma has
// grown accordingly.
struct CalibrationContradiction {
  std::string parameter;  // its name, or "clock_drift"
  std::string between;    // which parts: "stretches of time"
  double scatter = 1;     // of the parts' values, over the scatter that their noise explains
};

// A departure from the model that the residuals show beyond chance. If there is one, also a
// "possible" one that they do not exclude. The sigmas include its effect on the parameters.
struct CalibrationCause {
  std::string cause;  // "play of pan"
  double chi_square = 0;
  double freedom = 0;  // of chi_square
  double size = 0;     // of the departure, root mean square, in `unit`
  std::string unit;
};

struct CalibrationQuality {
  // RMS of residual / stated noise, redundancy accounted for; 1 if only chance makes a difference.
  double pixel_sigma_ratio = 0;
  double telemetry_sigma_ratio = 0;  // likewise
  // How many observations of a landmark in neighbouring frames count as one independent
  // observation, as their errors are correlated. 1: independent. The sigmas account for it.
  double repetition = 1;
  double mean_reprojection_error_px = 0;
  int frames = 0;  // here and below: counts of what was used
  int observations = 0;
  int landmarks = 0;
  int telemetry = 0;              // samples
  int steps = 0;                  // of the adjustment
  double motion_correlation = 0;  // of image motion and telemetry, at the start
  // Largest over smallest eigenvalue of the parameters' correlation matrix, and the eigenvector of
  // the largest one in words.
  double condition = 0;
  std::string weakest_direction;
  std::vector<std::string> advice;  // what motion or knowledge would help; also with kOk
  std::optional<CalibrationContradiction> contradiction;  // the worst
  std::vector<CalibrationCause> causes;                   // likeliest first, "possible" last

  // One line for each contradiction and each likely cause.
  [[nodiscard]] std::vector<std::string> describe_departures() const;
};

struct CalibrationResult {
  CalibrationStatus status = CalibrationStatus::kBadInput;
  std::string message;  // what is wrong and what would help; with kOk a summary
  // Meaningful with kOk and, for diagnosis, with kWeak, unless `frames` is empty: then a parameter
  // is undetermined.
  Calibration calibration;
  // Errors of the telemetry's angles that the data show, besides scale and noise. The calibration
  // and its covariance allow for them.
  TelemetryError telemetry_error;
  StreamTiming image_timing;
  StreamTiming telemetry_timing;
  TrajectorySpline trajectory;  // image clock
  std::vector<CalibrationLandmark> landmarks;
  std::vector<FrameResult> frames;
  std::vector<ObservationResidual> observation_residuals;
  std::vector<TelemetryResidual> telemetry_residuals;
  CalibrationExclusions exclusions;
  CalibrationQuality quality;
  std::optional<ParameterGoals> goals;  // what was judged; empty: it did not come so far
  std::optional<Nearness> nearness;     // of what is in view; empty: no scene was stated

  // px, of things so far away that the pupil's place does not matter. Empty: no scene was stated.
  [[nodiscard]] std::optional<CalibrationPrior> far_focal_length() const;

  [[nodiscard]] bool ok() const { return status == CalibrationStatus::kOk; }
};

}  // namespace alidade
