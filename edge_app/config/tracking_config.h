#pragma once
// Section `tracking`: the ground under the camera, and how targets are made from detections. The section makes `run` track: on the plane
// where one is given, else on the sphere.
//   plane: plane.yaml                      of alidade plane fit
//   space: plane | sphere                  sphere: also where a plane is given, for what flies
//   detection_sigma_px, false_alarms_per_frame, detection_probability, least_score        the detector
//   acceleration_density_m2_s3, first_velocity_sigma_m_s, most_sigma_m                    targets on the plane, or
//   acceleration_density_rad2_s3, first_velocity_sigma_rad_s, most_sigma_rad              on the sphere
//   association: exact | cheap | nearest
//   birth_hits, birth_looks, lose_after_s, forget_after_s
//   history_s, history_frames, max_targets, max_detections
// What each means, and its default: target_options.h, target_tracker.h.

#include <optional>
#include <string>

#include "edge_app/config/yaml_section.h"
#include "edge_app/tracking/target_options.h"

namespace alidade {

struct TrackingConfig {
  std::string plane;                     // a plane.yaml; empty: none
  std::optional<TargetOptions> targets;  // empty: there is no such section
};

// is_there: whether the file has the section. Throws ConfigError.
TrackingConfig read_tracking(YamlSection section, bool is_there, const std::string& config_path);

}  // namespace alidade
