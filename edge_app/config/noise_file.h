#pragma once
// noise.yaml of a recording: what is known about the noise of its streams. Everything is optional,
// the file too. A stamp sigma says that the stamps scatter to both sides of the true time (symmetric
// jitter); without it they are taken to be late only, as those of a live stream are.

#include <optional>
#include <string>

#include "core/calibration/calibrate.h"

namespace alidade {

struct RecordingNoise : CalibrationNoise {
  std::optional<double> pan_tilt_scale_sigma;  // prior of both scales
};

// Pure: text in, noise or one line of error out. name stands for the file in errors.
[[nodiscard]] bool parse_noise(const std::string& text, const std::string& name,
                               RecordingNoise* noise, std::string* error);

// False with a line FILE:LINE: ... in *error if directory/noise.yaml is there and malformed.
[[nodiscard]] bool load_noise(const std::string& directory, RecordingNoise* noise,
                              std::string* error);

}  // namespace alidade
