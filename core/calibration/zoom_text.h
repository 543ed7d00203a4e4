#pragma once
// The zoom curve (core/model/zoom_curve.h) of a calibration.yaml, whose other keys are the calibration at its `zoom`:
//   zoom_curve:
//     repeatability: 0.002                        sigma of log f after a movement of the zoom
//     smoothness: {log_focal_length: {level_sigma: ..., slope_sigma: ..., roughness: ...}, ...}
//     nodes:
//       - {reading: 1, log_focal_length: 7.09, corner_distortion: -0.06, centre_u: 19.9, centre_v: -12}
//       - {..., between_dwells: true}               what movements of the zoom showed, no dwell
//     covariance: {names: [log_focal_length@0, ..., clock_offset], matrix: [[...]]}    @: the node's number, from 0
// Comments tell focal lengths in px with their sigmas. What was written is read back to the last digits but one. Allocates.

#include <yaml-cpp/yaml.h>

#include "core/calibration/estimate_reader.h"
#include "core/model/zoom_curve.h"

namespace alidade::internal {

// shared: the file's calibration, whose image size and shared parameters are the curve's. Throws YamlError.
[[nodiscard]] ZoomCurve read_zoom_curve(const EstimateReader& file, const YAML::Node& node,
                                        const Calibration& shared);
// As the value of a key.
void write_zoom_curve(const ZoomCurve& curve, YAML::Emitter* out);

}  // namespace alidade::internal
