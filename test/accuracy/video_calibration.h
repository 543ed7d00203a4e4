#pragma once
// Calibration from video, as `alidade calibrate` makes it, on recordings of the virtual camera: is it as certain as it
// says? Every scene meets every path, and sizes, fields of view, qualities, lenses and read-outs change in turns.
//   scenes     four photos, each from near and from afar, which shows other parts and other detail of it
//   paths      cosine, sweep with stops and jerks at 0.5 to 0.7 horizontal fields of view a second, 12 to 20 s;
//              a slow one at 0.15, 30 s
//   qualities  noise of 2, 3 and 6 grey levels with JPEG 85, 75 and 60
// The simulator shares no code with what is tested (test/simulator/README.md). Writes each recording into a folder.

#include <array>
#include <filesystem>
#include <optional>
#include <string>

#include "core/calibration/calibration_difference.h"
#include "test/simulator/config.h"

namespace alidade::test {

inline constexpr int kVideoRecordings = 40;  // of an experiment

struct VideoRecording {
  std::string name;
  simulator::Config config;
};

// number: from 0, each another.
[[nodiscard]] VideoRecording video_recording(int number);

// Errors in units of their sigmas, and the errors themselves in the parameters' units, of kComparedParameters.
struct VideoErrors {
  std::array<double, kComparedParameters.size()> normalised{};
  std::array<double, kComparedParameters.size()> plain{};
};

// Writes the recording into `folder`, which must not exist, calibrates from it and removes it. Empty and one line in
// *error if there is no calibration.
[[nodiscard]] std::optional<VideoErrors> calibrate_video_recording(
    const VideoRecording& recording, const std::filesystem::path& folder, std::string* error);

}  // namespace alidade::test
