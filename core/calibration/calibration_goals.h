#pragma once
// How well a calibration must know its parameters, and how far the axes must turn for that: the
// limits by which judge() (sufficiency.h) decides (recording_needs.h), for one camera, and the
// motion that helps, in words. Whoever shows or asks for progress takes both from here. Pure.

#include <array>
#include <cstdint>
#include <optional>

#include "core/model/calibration.h"

namespace alidade {

// Motion that makes an uncertain parameter known.
enum class HelpfulMotion : std::uint8_t {
  kFarther,  // the focal length
  kVaried,   // the clock offset
  kFaster,   // the line delay
  kAcross    // the distortion
};
[[nodiscard]] const char* to_string(HelpfulMotion motion);

// One parameter that decides whether a calibration is good enough.
struct ParameterGoal {
  Parameter parameter = Parameter::kCount;
  const char* unit = "";        // of sigma and wanted; as the parameter has it
  const char* name = "";        // for people
  double easy = 1;              // factor from `unit` to easy_unit
  const char* easy_unit = "";   // a unit in which a sigma is easily judged: %, ms
  double wanted = 0;            // the largest sigma that is good enough
  std::optional<double> sigma;  // empty: no adjustment has come so far
  // sigma is small enough, or nothing that the camera films could make it smaller: a focal length
  // that cannot be told from the scale of the telemetry.
  bool reached = false;
  HelpfulMotion helps = HelpfulMotion::kFarther;
};
using ParameterGoals = std::array<ParameterGoal, 4>;

// The goals for this camera, without sigmas. camera: focal length and size > 0.
[[nodiscard]] ParameterGoals calibration_goals(const Camera<double>& camera);
// The same with the calibration's sigmas. `reached` is by sigma alone.
[[nodiscard]] ParameterGoals calibration_goals(const Calibration& calibration);

// The goal with the largest ratio of sigma to what is wanted, among those not reached; null: all
// are reached, or have no sigma.
[[nodiscard]] const ParameterGoal* farthest_goal(const ParameterGoals& goals);

// Ranges of one axis's motion, rad; the same for both axes.
struct TravelLimits {
  double least = 0;  // less is refused
  double asked = 0;  // what is asked for where there was less than `least`
};
[[nodiscard]] TravelLimits travel_limits(double focal_length_px, int width_px);

}  // namespace alidade
