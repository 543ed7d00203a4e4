#include "test/accuracy/kept_frames.h"

#include <array>
#include <cstdio>
#include <iomanip>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>
#include <tuple>

namespace alidade::test {
namespace {

using simulator::Config;
using simulator::PatchConfig;

// All that a noise-free frame under a zoom depends on besides.
template <class Add>
void add_zoom(const simulator::ZoomConfig& zoom, double path_focal_length, const Add& add) {
  const simulator::ZoomPathConfig& path = zoom.path;
  add('z', path_focal_length, zoom.focal_length.wide, zoom.focal_length.tele, zoom.shape,
      zoom.ripple, zoom.distortion.wide, zoom.distortion.tele, zoom.centre.transpose(),
      zoom.centre_wander, zoom.reading.wide, zoom.reading.tele, zoom.sigma_rep, zoom.backlash,
      zoom.speed, zoom.acceleration);
  add(static_cast<int>(path.type), path.reading.value_or(-1), path.factor, path.duration, path.stop,
      path.rate, path.file.string());
  for (const auto& stop : path.stops) {
    add(stop.reading.value_or(-1), stop.focal_length.value_or(-1), stop.rest);
  }
}

}  // namespace

std::string image_key(const Config& config) {
  std::ostringstream key;
  key << std::setprecision(17);
  const auto add = [&key](auto... values) { ((key << values << ' '), ...); };
  const auto& [image, camera, path, scene, sensor] =
      std::tie(config.image, config.camera, config.path, config.scene, config.sensor);
  add(config.seed, config.duration, image.width, image.height, image.rate_hz);
  add(camera.focal_length, camera.aspect, camera.radial_distortion, camera.line_delay);
  add(camera.pan_axis_offset.transpose(), camera.tilt_axis_offset.transpose());
  add(static_cast<int>(path.type), path.amplitude, path.period, path.stop, path.pan, path.tilt,
      path.file.string());
  add(scene.background, scene.detail);
  for (const auto* patches : {&scene.photos, &scene.procedural, &scene.flat, &scene.moving}) {
    add('|');
    for (const PatchConfig& patch : *patches) {
      add(patch.file.filename().string(), patch.azimuth, patch.elevation, patch.width, patch.height,
          patch.azimuth_rate, patch.elevation_rate, patch.brightness,
          static_cast<int>(patch.projection));
    }
  }
  if (config.zoom) add_zoom(*config.zoom, path.focal_length, add);
  add(sensor.exposure, sensor.vignetting, sensor.boil);
  for (const auto& step : sensor.brightness_steps) add(step.time, step.factor);
  for (const auto& interval : sensor.covered) add('-', interval.from, interval.to);
  return key.str();
}

KeptFrames::KeptFrames(const std::string& name, const std::string& key,
                       const std::filesystem::path& cache) {
  if (cache.empty()) return;
  std::ostringstream folder;
  folder << name << '-' << std::hex << std::hash<std::string>{}(key);
  folder_ = cache / folder.str();
  std::filesystem::create_directories(folder_);
}

cv::Mat KeptFrames::frame(int number, const std::function<cv::Mat()>& render) const {
  if (folder_.empty()) return render();
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "%06d.pgm", number);
  const std::string file = (folder_ / name.data()).string();
  if (std::filesystem::exists(file)) {
    cv::Mat image = cv::imread(file, cv::IMREAD_GRAYSCALE);
    if (image.empty()) throw std::runtime_error(file + ": cannot be read");
    return image;
  }
  cv::Mat image = render();
  // Under another name first: whoever stops in between leaves no half image.
  const std::string unfinished = file + ".part.pgm";
  if (!cv::imwrite(unfinished, image)) {
    throw std::runtime_error(unfinished + ": cannot be written");
  }
  std::filesystem::rename(unfinished, file);
  return image;
}

}  // namespace alidade::test
