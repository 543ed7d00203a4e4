#pragma once
// Do the data support a calibration, and what would help?
//   check_motion   before the adjustment: no motion, one axis only, constant velocity, telemetry
//                  that does not describe the video
//   judge          after the adjustment: an axis that did not move or lies where no head has it; a
//                  parameter that the data leave (nearly) open; a scale that cannot be separated
//                  from the focal length; axes and scales that rest on the prior; the weakest
//                  direction in words
// The limits follow from the purpose: directions of pixels must be good enough. Allocates.

#include <string>
#include <vector>

#include "core/calibration/calibration_types.h"
#include "core/calibration/motion_match.h"

namespace alidade::internal {

// kOk, or a refusal with its reason in *why.
[[nodiscard]] CalibrationStatus check_motion(const std::vector<ImageMotion>& motion,
                                             const TrajectorySpline& telemetry,
                                             const MotionMatch& match,
                                             const CalibrationInput& input, std::string* why);

// A question for the user, whether telemetry is in degrees; empty if the focal length does not
// suggest it. focal_length: from motion, px. width: of the image, px.
[[nodiscard]] std::string ask_for_degrees(double focal_length, int width);

// The extent of the motion, true angles.
struct MotionExtent {
  Vector2<double> range;         // rad, largest minus smallest, without 1 % at either end
  Vector2<double> largest_rate;  // rad/s
  Vector2<double> varying_rate;  // rad/s, standard deviation of the rate
};
// times_s: of the images, image clock. Only their span is measured: outside of it the trajectory
// rests on noisy telemetry alone.
[[nodiscard]] MotionExtent measure_motion(const TrajectorySpline& trajectory,
                                          const std::vector<double>& times_s);

// Fills status, message, condition, weakest_direction and advice of a result that has its
// calibration.
void judge(const CalibrationOptions& options, const MotionExtent& motion,
           CalibrationResult* result);

}  // namespace alidade::internal
