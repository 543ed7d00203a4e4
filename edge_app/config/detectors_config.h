#pragma once
// Section `detectors`: what `run` looks for in the pictures itself; each is off unless it is there.
//   motion: {}                 what moves against the scene (docs/motion_detection.md)
//     exposure_s               of a picture, at most about
//     least_size_px, most_size_px
//   people: {}                 who stands upright on the ground of tracking.plane
//     height_m, least_height_px, most_height_px, threshold
//   onnx:                      a network of the user's
//     model                    its file; needed
//     labels                   a file with the classes' names, one a line, of at most 32 bytes
//     width_px, height_px      of its input
//     threshold, most_overlap
// Files: relative to the configuration's. Takes section tracking, and realtime.mode OE. What each means, and its default: motion_detector.h, person_detector.h,
// network_detector.h.

#include "edge_app/config/yaml_section.h"
#include "edge_app/tracking/built_in_detectors.h"

namespace alidade {

// Throws ConfigError.
BuiltInDetectorOptions read_detectors(YamlSection section, const std::string& config_path);

}  // namespace alidade
