#pragma once
// Can these data support a calibration, and what would help? Two looks:
//   check_motion   before the adjustment: no motion, one axis only, telemetry that does not describe the video.
//   judge          after it: an axis that did not move after all, or comes out where no head has it. From the covariance: a
//                  parameter that the data leave (nearly) open, constant velocity, a scale that cannot be told from the focal
//                  length, axes and scales that only the prior holds; the weakest direction in words.
// The limits are those of use: what the calibration is for is to point a pixel. Allocates.

#include <string>
#include <vector>

#include "core/calibration/calibration_types.h"
#include "core/calibration/motion_match.h"

namespace alidade::internal {

// kOk, or a refusal and *why.
[[nodiscard]] CalibrationStatus check_motion(const std::vector<ImageMotion>& motion,
                                             const TrajectorySpline& telemetry,
                                             const MotionMatch& match,
                                             const CalibrationInput& input, std::string* why);

// A question for the user, where the focal length that motions gave (px) makes degrees likely; else nothing.
[[nodiscard]] std::string ask_for_degrees(double focal_length, int width);

// The motion that was there, true angles.
struct MotionExtent {
  Vector2<double> range;         // rad, largest less smallest, a few times apart
  Vector2<double> largest_rate;  // rad/s
  Vector2<double> varying_rate;  // rad/s, standard deviation of the rate
};
// At these times of the trajectory: before and after the pictures nothing but noisy telemetry holds it.
[[nodiscard]] MotionExtent measure_motion(const TrajectorySpline& trajectory,
                                          const std::vector<double>& times_s);

// Fills status, message, condition, weakest_direction and advice of a result whose calibration is complete.
void judge(const CalibrationOptions& options, const MotionExtent& motion,
           CalibrationResult* result);

}  // namespace alidade::internal
