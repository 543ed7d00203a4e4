#pragma once
// Errors of telemetry's angles (core/model/telemetry_error.h) in a calibration.yaml. All keys may
// be absent: then telemetry is exact, except for scale and noise.
//   pan_error: {knots_rad: {first: -0.4, spacing: 0.05}, values_rad: [...], sigma_rad: [...],
//               length_rad: 0.1, unseen_sigma_rad: 2e-4}
//   tilt_error: ...                                 likewise; without knots: unseen_sigma_rad alone
//   pan_play_rad: {value: 3e-4, sigma: 1e-5, kind: motor}      or output: where the encoder is
//   tilt_play_rad: ...
// Reading back what was written gives the same bits. Allocates.

#include <yaml-cpp/yaml.h>

#include "core/calibration/estimate_reader.h"
#include "core/model/telemetry_error.h"

namespace alidade::internal {

// Throws YamlError. Without a key its part of the result does not exist().
[[nodiscard]] TelemetryError read_telemetry_error(const EstimateReader& file);
// Writes the keys that are needed into a map.
void write_telemetry_error(const TelemetryError& error, YAML::Emitter* out);

}  // namespace alidade::internal
