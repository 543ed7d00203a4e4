#pragma once
// Do the data support a calibration, and what would help?
//   check_motion   before the adjustment: tracks too short, no motion, one axis only, constant
//                  velocity, angles in degrees, telemetry for less than half of the video, of a
//                  reversed axis, or that does not describe the video
//   judge          after the adjustment: an axis that did not move or lies where no head has it; a
//                  parameter that is too uncertain; parts that contradict each other without a
//                  known cause; advice on scales and axes that rest on their priors
// How well the parameters must be known: calibration_goals.h. Allocates.

#include <string>
#include <vector>

#include "core/calibration/calibration_types.h"
#include "core/calibration/motion_match.h"

namespace alidade::internal {

// kOk, or a refusal with its reason in *why: kTooFewLandmarks (tracks too short), kNoMotion,
// kOneAxisOnly, kConstantVelocity, kBadInput (degrees, or telemetry for less than half of the
// video), kTelemetryMismatch. telemetry: measured angles over the telemetry clock. match: of these
// two.
[[nodiscard]] CalibrationStatus check_motion(const std::vector<ImageMotion>& motion,
                                             const TrajectorySpline& telemetry,
                                             const MotionMatch& match,
                                             const CalibrationInput& input, std::string* why);

// Asks the user whether the angles are in degrees; begins with a space, to continue a message.
// Empty if focal_length (from motion, px) is more than three times the image's width (px): degrees
// that are read as radians make it 57 times too small.
[[nodiscard]] std::string ask_for_degrees(double focal_length, int width);

// The extent of a trajectory's motion, (pan, tilt).
struct MotionExtent {
  Vector2<double> range;         // rad, largest minus smallest, without 1 % of times at each end
  Vector2<double> largest_rate;  // rad/s
  Vector2<double> varying_rate;  // rad/s, standard deviation of the rate
};
// times_s: of the images, on the trajectory's clock. Only these times are looked at: elsewhere the
// trajectory rests on noisy telemetry alone. All 0 if there are none.
[[nodiscard]] MotionExtent measure_motion(const TrajectorySpline& trajectory,
                                          const std::vector<double>& times_s);

// After fill_result(). Sets status and message: kOk, kWeak or, for a refused axis, kOneAxisOnly or
// kTelemetryMismatch. Unless an axis is refused, also sets goals, condition and weakest_direction,
// and adds to advice. motion: of the result's trajectory.
void judge(const CalibrationOptions& options, const MotionExtent& motion,
           CalibrationResult* result);

}  // namespace alidade::internal
