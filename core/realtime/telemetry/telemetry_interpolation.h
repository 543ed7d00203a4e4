#pragma once
// Where the mount pointed between two telemetry samples, how fast it turned, and how well that is
// known: the mathematics behind TelemetryBuffer, on a short run of neighbouring samples.
//
// The plain answer is PTCEE 22 to 25: a straight line through the two samples around the time asked
// for. Where at least 6 (at most 8) neighbours lie on a cubic in time within their noise, that cubic
// answers instead, as it averages the noise and follows the curve. It is fitted by least squares and
// held against a chi-square bound (95 %); a jerk of the mount fails the test, and the line speaks,
// with the curvature of its surroundings added to its covariance. Both answers are weighted sums of
// the samples, so one formula gives the exact first-order covariance of angle and rate together.
//
// A stamp's error has a part that neighbouring samples share (a clock's offset) and a part of its
// own; the difference of two own parts has the standard deviation period_sigma_s (PTCEE 20, 21, made
// symmetric in the two samples). A rate w turns a time error tau into an angle error w tau of both
// axes, an acceleration a into a tau^2 / 2. Angles in rad as measured, times in s on the telemetry clock. No allocation.

#include <cstdint>
#include <limits>

#include "core/model/angle.h"
#include "core/model/linear_algebra.h"

namespace alidade {

struct TelemetryNoise {
  double pan_tilt_sigma = 1e-4;   // rad, white noise of one measured angle
  double resolution = 0;          // rad, smallest step of a measured angle; 0 = none
  double period_sigma_s = 50e-6;  // s, of the time between two neighbouring samples
  // rad/s^2, acceleration to expect of either axis where the samples do not show it: beside a jerk, and
  // with too few samples. Beyond the newest sample the least to expect; 0: the mount keeps its rate. One
  // standard deviation.
  double acceleration_sigma = 0.1;

  // False and one line in *error (if not null) when a value is not valid.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// A sample as the buffer keeps it.
struct TelemetryKnot {
  double time_s;
  double pan;              // rad, continuous: not wrapped
  double tilt;             // rad, continuous
  double shared_variance;  // s^2, of the stamp: the part shared with the neighbours
  double own_variance;     // s^2, of the stamp: this sample's own part
  bool held;               // the mount stood still since the knot before
};

struct InterpolatedPanTilt {
  double time_s = 0;        // that was asked for, telemetry clock
  double time_sigma_s = 0;  // of it, one standard deviation
  PanTilt<double> angle;    // rad, measured units, wrapped
  PanTilt<double> rate;     // rad/s, measured units
  // Of (pan, tilt, pan rate, tilt rate).
  Matrix4<double> covariance = Matrix4<double>::Zero();
  // (rad/s^2)^2, expected square of the acceleration (pan, tilt) about this time.
  Vector2<double> acceleration_square = Vector2<double>::Zero();
  // rad/s^2, the acceleration itself, where somebody knows it; of either axis.
  PanTilt<double> acceleration = {};
  double acceleration_sigma = std::numeric_limits<double>::infinity();  // > 0
  bool extrapolated = false;  // the time lies beyond the samples
  int samples = 0;            // how many the answer rests on: 2 is the straight line
  // s, after which the error of the angle is another: the same samples answer for a while, and what the
  // clock or an unknown acceleration does lasts for about a second. So much time is worth one
  // independent answer.
  double correlation_time_s = 0;
};

// What acceleration to expect of a mount that goes on as it did: the fourth root of the mean fourth power of
// what second differences show of its last seconds, less what noise makes of them. The fourth power, as a
// mount that stops at once does so seldom and by much. Knots are given from the newest back.
class ExpectedAcceleration {
 public:
  static constexpr double kMemory = 5;  // s, that are worth looking at

  // step_s: of the differences; about as long as what is to be extrapolated.
  ExpectedAcceleration(const TelemetryNoise& noise, double step_s);
  void add(const TelemetryKnot& knot);
  // Squares (pan, tilt), (rad/s^2)^2; at least acceleration_sigma's, and what brings the latest rate to rest
  // in a second.
  [[nodiscard]] Vector2<double> square() const;

 private:
  TelemetryNoise noise_;
  double step_s_;
  TelemetryKnot newest_{};  // the two that the next one makes a difference with
  TelemetryKnot middle_{};
  int knots_ = 0;
  int differences_ = 0;
  Vector2<double> latest_rate_ = Vector2<double>::Zero();
  Vector2<double> fourth_powers_ = Vector2<double>::Zero();
};

inline constexpr int kInterpolationWindow = 8;

// knots[0..count), 2 <= count <= kInterpolationWindow, times strictly ascending; the time asked for
// lies between knots[before] and knots[before + 1], or beyond the end that is nearest to it.
// beyond_square: (rad/s^2)^2, (pan, tilt), accelerations to expect beyond the ends. False if the result
// cannot be represented; *out is then untouched.
[[nodiscard]] bool interpolate(const TelemetryNoise& noise, const TelemetryKnot* knots, int count,
                               int before, double time_s, double time_sigma_s,
                               const Vector2<double>& beyond_square, InterpolatedPanTilt* out);

}  // namespace alidade
