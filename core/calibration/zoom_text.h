#pragma once
// The zoom curve (core/model/lens/zoom_curve.h) in a calibration.yaml. The file's other keys are
// the calibration at its `zoom`.
//   zoom_curve:
//     repeatability: 0.002                        sigma of log f after a movement of the zoom
//     smoothness: {log_focal_length: {level_sigma: ..., slope_sigma: ..., roughness: ...}, ...}
//     nodes:
//       - {reading: 1, log_focal_length: 7.1, corner_distortion: -0.1, centre_u: 20, centre_v: -12}
//       - {..., between_dwells: true}               from a movement of the zoom, not a dwell
//     covariance: {names: [log_focal_length@0, ..., clock_offset], matrix: [[...]]}
// The number after @ is the node's, from 0. YAML comments give focal lengths in px with sigmas.
// Values are read back to the last digits but one. Allocates.

#include <yaml-cpp/yaml.h>

#include "core/calibration/estimate_reader.h"
#include "core/model/lens/zoom_curve.h"

namespace alidade::internal {

// node: the value of the key zoom_curve. shared: the file's calibration, which provides image size
// and shared parameters. Throws YamlError.
[[nodiscard]] ZoomCurve read_zoom_curve(const EstimateReader& file, const YAML::Node& node,
                                        const Calibration& shared);
// Writes it as the value of a key.
void write_zoom_curve(const ZoomCurve& curve, YAML::Emitter* out);

}  // namespace alidade::internal
