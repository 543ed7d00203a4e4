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
  const auto goal = [](Parameter parameter, const char* unit, double wanted, HelpfulMotion helps) {
    ParameterGoal out;
    out.parameter = parameter;
    out.unit = unit;
    out.wanted = wanted;
    out.helps = helps;
    return out;
  };
  return {goal(Parameter::kFocalLength, "px", kMaxFocalLengthError * camera.focal_length,
               HelpfulMotion::kFarther),
          goal(Parameter::kClockOffset, "s", kMaxClockOffsetError_s, HelpfulMotion::kVaried),
          goal(Parameter::kLineDelay, "s/row", kMaxReadoutError_s / camera.height,
               HelpfulMotion::kFaster),
          goal(Parameter::kRadialDistortion, "1", kMaxDistortionError * corner_unit(camera)[0],
               HelpfulMotion::kAcross)};
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
