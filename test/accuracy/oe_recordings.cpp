#include "test/accuracy/oe_recordings.h"

#include "test/accuracy/rendered_recording.h"

namespace alidade::test {
namespace {

using simulator::Config;
using simulator::PatchConfig;
using PathType = simulator::PathConfig::Type;

constexpr double kFocalLength1920 = 32008;  // px

}  // namespace

Config camera_on_path(const Scene& scene, PathType path, double line_delay_1080,
                      double fields_per_second, const RecordingSize& size, std::uint64_t seed) {
  Config config;
  config.seed = seed;
  config.duration = size.duration_s;
  config.image = {size.width, size.height, size.rate_hz};
  config.camera.focal_length = kFocalLength1920 * size.width / 1920;
  config.camera.radial_distortion = 55.4;
  config.camera.line_delay = line_delay_1080 * 1080 / size.height;
  config.camera.pan_axis_offset = {-12e-3, 0};
  config.camera.tilt_axis_offset = {0, 14e-3};
  config.camera.pan_scale = 1.001;
  config.camera.tilt_scale = 0.9995;
  config.camera.clock_offset = -84.4e-3;
  config.path.type = path;
  config.path.period = size.duration_s;
  config.path.stop = 0.1 * size.duration_s;
  set_peak_speed(fields_per_second, &config);
  config.telemetry.rate_hz = 40;
  config.telemetry.sigma = 1 / kFocalLength1920;
  config.sensor.exposure = 2e-3;
  config.sensor.read_noise = 2;
  config.sensor.jpeg_quality = 85;

  // Wide enough for the widest path here, no wider: a photo's own pixels are few.
  PatchConfig patch;
  patch.file = scene.photo;
  patch.width = 3.2 * simulator::horizontal_field_of_view(config);
  patch.height = 0.75 * patch.width;
  (scene.photo.empty() ? config.scene.procedural : config.scene.photos).push_back(patch);
  return config;
}

std::vector<RecordingPlan> latin_square(const std::vector<Scene>& scenes, double fields_per_second,
                                        const RecordingSize& size) {
  struct NamedPath {
    const char* name;
    PathType type;
  };
  constexpr NamedPath kPaths[] = {{"cosine", PathType::kTripleCosine},
                                  {"stops", PathType::kSweep},
                                  {"jerky", PathType::kJerky}};
  constexpr const char* kDelayNames[] = {"-14us", "0us", "+25us"};
  std::vector<RecordingPlan> plans;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const std::size_t delay = (i + j) % 3;
      const std::uint64_t seed = plans.size() + 1;
      plans.push_back({scenes[i].name + "_" + kPaths[j].name + "_" + kDelayNames[delay],
                       camera_on_path(scenes[i], kPaths[j].type, kLineDelays[delay],
                                      fields_per_second, size, seed)});
    }
  }
  return plans;
}

std::vector<Disturbance> disturbances(const Scene& scene, const RecordingSize& size) {
  const Config normal =
      camera_on_path(scene, PathType::kTripleCosine, kLineDelays[0], 0.5, size, 1);
  const double from = 0.4 * size.duration_s;
  const double to = from + 2;
  const double field = simulator::horizontal_field_of_view(normal);
  std::vector<Disturbance> all;
  const auto add = [&](const char* name) -> Disturbance& {
    Disturbance disturbance;
    disturbance.name = name;
    disturbance.config = normal;
    disturbance.from = from;
    disturbance.to = to;
    all.push_back(disturbance);
    return all.back();
  };

  add("nothing");
  add("lens covered").config.sensor.covered.push_back({from, to});
  // Half the light between the two times.
  add("brightness halved").config.sensor.brightness_steps = {{from, 0.5}, {to, 1}};

  {
    // A swarm that crosses the view from left to right: 10 x 3 objects of 0.17 fields of view, one every
    // 0.31, so 30 % of what they cross. It fills the view between the two times.
    Disturbance& disturbance = add("30 % moving objects");
    constexpr int kColumns = 10;
    constexpr int kRows = 3;
    constexpr double kPitch = 0.31;
    const double rate = 0.9 * field;
    for (int column = 0; column < kColumns; ++column) {
      for (int row = 0; row < kRows; ++row) {
        PatchConfig object;
        object.width = object.height = 0.17 * field;
        object.brightness = 0.15 + 0.12 * ((column * 5 + row * 3) % 7);
        object.azimuth_rate = rate;
        object.azimuth = (column - (kColumns - 1) / 2.0) * kPitch * field - rate * (from + to) / 2;
        object.elevation = (row - (kRows - 1) / 2.0) * kPitch * field;
        disturbance.config.scene.moving.push_back(object);
      }
    }
  }
  {
    Disturbance& disturbance = add("all sky");
    disturbance.config.scene.photos.clear();
    disturbance.config.scene.procedural.clear();
    disturbance.config.scene.background = 0.7;
    disturbance.from = 0;
    disturbance.to = size.duration_s;
  }
  {
    Disturbance& disturbance = add("boil of 1 px");
    disturbance.config.sensor.boil = 1;
    disturbance.from = 0;
    disturbance.to = size.duration_s;
  }
  {
    Disturbance& disturbance = add("telemetry 60 px off, says so");
    disturbance.telemetry_offset_px = 60;
    disturbance.claimed_sigma_px = 60;
  }
  {
    Disturbance& disturbance = add("telemetry 60 px off, says 3");
    disturbance.telemetry_offset_px = 60;
    disturbance.claimed_sigma_px = 3;
    disturbance.honest = false;
  }
  add("telemetry lost").telemetry_lost = true;
  return all;
}

}  // namespace alidade::test
