#pragma once
// Errors of telemetry's angles (core/model/telemetry_error.h) in a calibration.yaml. Each key is
// optional; without it telemetry has no such error.
//   pan_error: {knots_rad: {first: -0.4, spacing: 0.05}, values_rad: [...], sigma_rad: [...],
//               length_rad: 0.1, unseen_sigma_rad: 2e-4}
//   tilt_error: ...    likewise. knots_rad, values_rad and sigma_rad: all three or none; length_rad
//                      is optional
//   pan_play_rad: {value: 3e-4, sigma: 1e-5, kind: motor}    kind: motor or output (play.h)
//   tilt_play_rad: ...
// Reading back what was written gives the same bits. Allocates.

#include <yaml-cpp/yaml.h>

#include "core/calibration/estimate_reader.h"
#include "core/model/telemetry_error.h"

namespace alidade::internal {

// Throws YamlError. If a key is absent, its part of the result has exists() == false.
[[nodiscard]] TelemetryError read_telemetry_error(const EstimateReader& file);
// Writes the keys that are needed into a map.
void write_telemetry_error(const TelemetryError& error, YAML::Emitter* out);

}  // namespace alidade::internal
