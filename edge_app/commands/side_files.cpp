#include "edge_app/commands/side_files.h"

#include <fmt/format.h>

#include <filesystem>

#include "edge_app/commands/command.h"
#include "platform/system/whole_file.h"

namespace alidade {

bool write_side_files(const Config& config, const std::string& directory, std::string* error) {
  const auto write = [&](const char* name, const std::string& text) {
    return write_file_atomically((std::filesystem::path(directory) / name).string(), text, error);
  };
  std::string noise;
  if (config.pan_tilt.angle_sigma_rad)
    noise += fmt::format("pan_tilt_sigma_rad: {}\n", *config.pan_tilt.angle_sigma_rad);
  if (config.pan_tilt.angle_quantum_rad > 0)
    noise += fmt::format("pan_tilt_quantum_rad: {}\n", config.pan_tilt.angle_quantum_rad);
  if (!noise.empty() && !write("noise.yaml", noise)) return false;
  // The focal length of a zoom lens is not known in advance.
  if (!config.camera.focal_length_px || config.camera.focal_length_range) return true;
  const Camera<double>& camera = data_sheet_calibration(config.camera).camera;
  return write("guess.yaml",
               fmt::format("focal_length: {{value: {}}}\nradial_distortion: {{value: {}}}\n",
                           camera.focal_length, camera.distortion.only_term()));
}

}  // namespace alidade
