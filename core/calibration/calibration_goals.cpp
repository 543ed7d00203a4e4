#include "core/calibration/calibration_goals.h"

#include "core/model/lens/zoom_law.h"
#include "core/model/recording_needs.h"

namespace alidade {

const char* to_string(HelpfulMotion motion) {
  switch (motion) {
    case HelpfulMotion::kFarther:
      return "move farther on both axes";
    case HelpfulMotion::kVaried:
      return "change speed and direction more and faster";
    case HelpfulMotion::kFaster:
      return "move faster while the image is read out";
    case HelpfulMotion::kAcross:
      return "let landmarks cross the whole image";
  }
  return "unknown motion";
}

ParameterGoals calibration_goals(const Camera<double>& camera) {
  static_assert(kDistortionCount == 1, "each term is to be known well enough");
  const double f = camera.focal_length;
  const double corner = corner_unit(camera)[0];
  return {{{Parameter::kFocalLength,
            "px",
            "focal length",
            100 / f,
            "%",
            kMaxFocalLengthError * f,
            {},
            false,
            HelpfulMotion::kFarther},
           {Parameter::kClockOffset,
            "s",
            "clock offset",
            1e3,
            "ms",
            kMaxClockOffsetError_s,
            {},
            false,
            HelpfulMotion::kVaried},
           {Parameter::kLineDelay,
            "s/row",
            "read-out",
            1e3 * camera.height,
            "ms",
            kMaxReadoutError_s / camera.height,
            {},
            false,
            HelpfulMotion::kFaster},
           {Parameter::kRadialDistortion,
            "1",
            "radial distortion",
            100 / corner,
            "%",
            kMaxDistortionError * corner,
            {},
            false,
            HelpfulMotion::kAcross}}};
}

ParameterGoals calibration_goals(const Calibration& calibration) {
  ParameterGoals goals = calibration_goals(calibration.camera);
  for (ParameterGoal& goal : goals) {
    goal.sigma = parameter_sigma(calibration, goal.parameter);
    goal.reached = *goal.sigma <= goal.wanted;
  }
  return goals;
}

const ParameterGoal* farthest_goal(const ParameterGoals& goals) {
  const ParameterGoal* farthest = nullptr;
  double most = 0;
  for (const ParameterGoal& goal : goals) {
    if (goal.reached || !goal.sigma) continue;
    const double ratio = *goal.sigma / goal.wanted;
    if (farthest != nullptr && !(ratio > most)) continue;
    farthest = &goal;
    most = ratio;
  }
  return farthest;
}

TravelLimits travel_limits(double focal_length_px, int width_px) {
  const double width_rad = width_px / focal_length_px;
  return {kMinTravelShare * width_rad, kGoodTravelShare * width_rad};
}

}  // namespace alidade
