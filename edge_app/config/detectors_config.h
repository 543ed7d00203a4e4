#pragma once
// Section `detectors`: what `run` itself looks for in the pictures. A detector is off unless its
// key is there. The section needs section `tracking` and realtime.mode OE (config.cpp checks that).
//   motion: {}                 what moves against the scene (docs/motion_detection.md)
//     exposure_s               of a picture, about, at most
//     least_size_px, most_size_px
//   people: {}                 people who stand upright on the ground of tracking.plane
//     height_m, least_height_px, most_height_px, threshold
//   onnx:                      the user's network
//     model                    its file; required
//     labels                   a file with the names of its classes, one a line, at most 32 bytes
//     width_px, height_px      of its input
//     threshold, most_overlap
// Paths are relative to the configuration's folder. Meanings and defaults: motion_detector.h,
// person_detector.h, network_detector.h.

#include "edge_app/config/yaml_section.h"
#include "edge_app/tracking/built_in_detectors.h"

namespace alidade {

// Throws ConfigError.
BuiltInDetectorOptions read_detectors(YamlSection section, const std::string& config_path);

}  // namespace alidade
