#pragma once
// Angle and rate of the mount between telemetry samples, with covariance. Used by TelemetryBuffer
// on a short run of neighbouring samples. Angles in rad as measured; times in s, telemetry clock.
// The plain answer is a straight line through the two samples around the time (PTCEE 22 to 25). A
// least-squares cubic replaces it if 6 to 8 neighbours pass a chi-square test (95 %). Both are
// weighted sums of the samples, so the first-order covariance of angle and rate is exact.
// The difference of two stamps' own errors has the standard deviation period_sigma_s (PTCEE 20,
// 21). Why a cubic, and how stamps' errors enter: docs/derivations.md. No allocation.

#include <cstdint>
#include <limits>

#include "core/model/angle.h"
#include "core/model/linear_algebra.h"

namespace alidade {

// All values are >= 0; pan_tilt_sigma and resolution must not both be 0.
struct TelemetryNoise {
  double pan_tilt_sigma = 1e-4;   // rad, white noise of one measured angle
  double resolution = 0;          // rad, smallest step of a measured angle; 0: none
  double period_sigma_s = 50e-6;  // s, of the time between two neighbouring samples
  // rad/s^2, one standard deviation; acceleration expected of each axis if the samples do not show
  // it: near a jerk, and with too few samples. Beyond the samples it is the lower limit of
  // ExpectedAcceleration. 0: the mount keeps its rate.
  double acceleration_sigma = 0.1;

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// A sample as the buffer keeps it.
struct TelemetryKnot {
  double time_s;
  double pan;              // rad, continuous: not wrapped
  double tilt;             // rad, continuous
  double shared_variance;  // s^2, of the stamp: part shared with the neighbours
  double own_variance;     // s^2, of the stamp: this sample's own part
  bool held;               // the mount stood still since the previous knot
};

struct InterpolatedPanTilt {
  double time_s = 0;        // s, telemetry clock
  double time_sigma_s = 0;  // s
  PanTilt<double> angle;    // rad, measured units, wrapped
  PanTilt<double> rate;     // rad/s, measured units
  // Order: pan, tilt, pan rate, tilt rate.
  Matrix4<double> covariance = Matrix4<double>::Zero();
  // (pan, tilt): the part of `covariance` that comes from an error which depends on the angle
  // (telemetry_error.h), rad^2, and its correlation length, rad. 0: no such part is known.
  Vector2<double> error_variance = Vector2<double>::Zero();
  Vector2<double> error_length = Vector2<double>::Zero();
  // (rad/s^2)^2, expected square of the acceleration (pan, tilt) near this time.
  Vector2<double> acceleration_square = Vector2<double>::Zero();
  // rad/s^2, the acceleration itself, if known.
  PanTilt<double> acceleration = {};
  double acceleration_sigma = std::numeric_limits<double>::infinity();  // rad/s^2, > 0
  bool extrapolated = false;  // the time is beyond the samples
  int samples = 0;            // samples used; 2: the straight line
  // s, until the angle's error is independent. The same samples answer for a while, and the errors
  // of the clock or of an unknown acceleration last about a second. Answers within this time are
  // worth one independent answer.
  double correlation_time_s = 0;
};

// Expected acceleration of a mount that continues as before: the fourth root of the mean fourth
// power of the last seconds' second differences, minus their noise. The fourth power is used
// because a mount that stops abruptly does so rarely and strongly. Knots are added from the newest
// to older ones.
class ExpectedAcceleration {
 public:
  static constexpr double kMemory = 5;  // s; older knots are not needed

  // step_s: s; knots of a difference are about this far apart or more: the time to extrapolate.
  ExpectedAcceleration(const TelemetryNoise& noise, double step_s);
  void add(const TelemetryKnot& knot);
  // Squares (pan, tilt), (rad/s^2)^2. At least acceleration_sigma's, and what stops the latest rate
  // within a second. 0 if acceleration_sigma is 0.
  [[nodiscard]] Vector2<double> square() const;

 private:
  TelemetryNoise noise_;
  double step_s_;
  TelemetryKnot newest_{};  // these two and the next knot make a difference
  TelemetryKnot middle_{};
  int knots_ = 0;
  int differences_ = 0;
  Vector2<double> latest_rate_ = Vector2<double>::Zero();
  Vector2<double> fourth_powers_ = Vector2<double>::Zero();
};

inline constexpr int kInterpolationWindow = 8;

// noise: valid. knots[0..count): 2 <= count <= kInterpolationWindow, times strictly ascending.
// time_s lies between knots[before] and knots[before + 1], or beyond the nearer end. beyond_square:
// (rad/s^2)^2, (pan, tilt), expected accelerations beyond the ends.
// Does not write error_variance, error_length, acceleration and acceleration_sigma. False if the
// result cannot be represented; *out is then unchanged.
[[nodiscard]] bool interpolate(const TelemetryNoise& noise, const TelemetryKnot* knots, int count,
                               int before, double time_s, double time_sigma_s,
                               const Vector2<double>& beyond_square, InterpolatedPanTilt* out);

}  // namespace alidade
