#pragma once
// Section `tracking`: the ground under the camera, and how detections become targets. If the
// section is there, `run` tracks: on the plane if one is given, otherwise on the sphere.
//   plane: plane.yaml                  written by alidade plane fit
//   space: plane | sphere              sphere despite a plane: for targets that fly
//   Detector: detection_sigma_px, false_alarms_per_frame, detection_probability, least_score
//   On the plane: acceleration_density_m2_s3, first_velocity_sigma_m_s, most_sigma_m
//   On the sphere: acceleration_density_rad2_s3, first_velocity_sigma_rad_s, most_sigma_rad
//   association: exact | cheap | nearest
//   birth_hits, birth_looks, lose_after_s, forget_after_s
//   history_s, history_frames, max_targets, max_detections
// Meanings and defaults: target_options.h, target_tracker.h.

#include <optional>
#include <string>

#include "edge_app/config/yaml_section.h"
#include "edge_app/tracking/target_options.h"

namespace alidade {

struct TrackingConfig {
  std::string plane;                     // a plane.yaml; empty: none
  std::optional<TargetOptions> targets;  // empty: the file has no section `tracking`
};

// is_there: whether the file has the section. Throws ConfigError.
TrackingConfig read_tracking(YamlSection section, bool is_there, const std::string& config_path);

}  // namespace alidade
