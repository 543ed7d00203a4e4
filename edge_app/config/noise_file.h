#pragma once
// noise.yaml of a recording: the noise of its streams. Every key is optional, and so is the file.
// pixel_sigma_px is accepted and not used. A stamp sigma says that the time stamps scatter to both
// sides of the true time (symmetric jitter). Without a stamp sigma the time stamps are assumed to
// be late only, as in a live stream.

#include <optional>
#include <string>

#include "core/calibration/calibrate.h"

namespace alidade {

struct RecordingNoise : CalibrationNoise {
  std::optional<double> pan_tilt_scale_sigma;   // prior of both scales
  std::optional<double> pan_tilt_accuracy_rad;  // the maker's claim, see CalibrationOptions
  // Step of the readings, for replays; `calibrate` finds it from them.
  std::optional<double> pan_tilt_quantum_rad;
};

// Pure. False with one line in *error. `name` names the file in errors.
[[nodiscard]] bool parse_noise(const std::string& text, const std::string& name,
                               RecordingNoise* noise, std::string* error);

// False with one line FILE:LINE: ... in *error if directory/noise.yaml exists and is malformed.
[[nodiscard]] bool load_noise(const std::string& directory, RecordingNoise* noise,
                              std::string* error);

}  // namespace alidade
