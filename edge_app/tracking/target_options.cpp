#include "edge_app/tracking/target_options.h"

#include <cmath>

namespace alidade {

bool TargetOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(std::isfinite(detection_sigma_px) && detection_sigma_px > 0))
    problem = "detection_sigma_px must be positive";
  if (!(std::isfinite(false_alarms) && false_alarms > 0)) problem = "false_alarms must be positive";
  if (!(least_score >= 0 && least_score <= 1)) problem = "least_score must be from 0 to 1";
  if (problem == nullptr) return tracker.validate(error);
  if (error != nullptr) *error = problem;
  return false;
}

TargetOptions default_target_options(TargetSpace space) {
  TargetOptions options;
  options.tracker.space = space;
  options.tracker.history_frames = 128;
  if (space == TargetSpace::kSphere) {
    options.tracker.acceleration_density = 5e-5;
    options.tracker.sigma_first_velocity = 0.05;
    options.tracker.most_sigma = 0.3;
  }
  return options;
}

}  // namespace alidade
