#include "edge_app/config/noise_file.h"

#include <filesystem>

#include "edge_app/config/yaml_section.h"

namespace alidade {

namespace {

void read_noise(YamlSection& top, RecordingNoise* noise) {
  constexpr NumberRange kStampSigma{1e-9, 10, "s"};
  constexpr NumberRange kPeriod{1e-6, 10, "s"};
  noise->image_stamp_sigma_s = top.number("image_stamp_sigma_s", kStampSigma);
  noise->image_period_s = top.number("image_period_s", kPeriod);
  noise->image_period_sigma_s = top.number("image_period_sigma_s", kStampSigma);
  noise->telemetry_stamp_sigma_s = top.number("telemetry_stamp_sigma_s", kStampSigma);
  noise->telemetry_period_s = top.number("telemetry_period_s", kPeriod);
  noise->telemetry_period_sigma_s = top.number("telemetry_period_sigma_s", kStampSigma);
  noise->pan_tilt_sigma_rad = top.number("pan_tilt_sigma_rad", {1e-9, 0.1, "rad"});
  noise->pan_tilt_scale_sigma = top.number("pan_tilt_scale_sigma", {0, 1, "1"});
  noise->pan_tilt_accuracy_rad = top.number("pan_tilt_accuracy_rad", {0, 0.1, "rad"});
  noise->pan_tilt_quantum_rad = top.number("pan_tilt_quantum_rad", {1e-9, 0.1, "rad"});
  // Accepted but not used: each track has its own sigma.
  static_cast<void>(top.number("pixel_sigma_px", {0, 100, "px"}));
  top.finish();
}

}  // namespace

bool parse_noise(const std::string& text, const std::string& name, RecordingNoise* noise,
                 std::string* error) {
  *noise = RecordingNoise();
  return parse_yaml(
      text, name, [noise](YamlSection& top) { read_noise(top, noise); }, error);
}

bool load_noise(const std::string& directory, RecordingNoise* noise, std::string* error) {
  *noise = RecordingNoise();
  const std::filesystem::path path = std::filesystem::path(directory) / "noise.yaml";
  if (!std::filesystem::exists(path)) return true;
  return read_yaml_file(
      path.string(), [noise](YamlSection& top) { read_noise(top, noise); }, error);
}

}  // namespace alidade
