#include "test/simulator/resize.h"

#include <cstdio>

namespace alidade::simulator {
namespace {

void scale(ZoomConfig::Ends* ends, double factor) {
  ends->wide *= factor;
  ends->tele *= factor;
}

// RTP carries JPEG only in multiples of 8.
bool is_for_rtp_jpeg(int width, int height) { return width % 8 == 0 && height % 8 == 0; }

}  // namespace

void resize(const std::string& size, Config* config) {
  int width = 0;
  int height = 0;
  int read = 0;
  if (std::sscanf(size.c_str(), "%5dx%5d%n", &width, &height, &read) != 2 ||
      static_cast<std::size_t>(read) != size.size() || width < 32 || height < 32 || width > 8192 ||
      height > 8192) {
    throw ConfigError("--size: '" + size +
                      "' is no size; expected WIDTHxHEIGHT, 32 to 8192 px, as 480x270");
  }
  const double factor = static_cast<double>(width) / config->image.width;
  config->camera.line_delay *= static_cast<double>(config->image.height) / height;
  if (config->live.encoding.codec == VideoCodec::kMjpeg && !is_for_rtp_jpeg(width, height) &&
      is_for_rtp_jpeg(config->image.width, config->image.height)) {
    config->live.encoding.codec = VideoCodec::kH264;
  }
  config->image.width = width;
  config->image.height = height;
  config->camera.focal_length *= factor;
  config->camera.centre *= factor;
  config->path.focal_length *= factor;
  if (config->guess_focal_length) *config->guess_focal_length *= factor;
  if (config->zoom) {
    scale(&config->zoom->focal_length, factor);
    config->zoom->centre *= factor;
    config->zoom->centre_wander *= factor;
    for (ZoomPathConfig::Stop& stop : config->zoom->path.stops) {
      if (stop.focal_length) *stop.focal_length *= factor;
    }
  }
  config->sensor.boil *= factor;
  config->sensor.boil_length *= factor;
  SceneConfig& scene = config->scene;
  for (auto* patches : {&scene.photos, &scene.procedural, &scene.flat, &scene.moving}) {
    for (PatchConfig& patch : *patches) {
      if (!patch.flutter) continue;
      patch.flutter->rms_px *= factor;
      patch.flutter->size_px *= factor;
    }
  }
  if (scene.clouds) {
    scene.clouds->rate_px *= factor;
    scene.clouds->size_px *= factor;
  }
  if (scene.water) {
    scene.water->rate_px *= factor;
    scene.water->size_px *= factor;
  }
}

}  // namespace alidade::simulator
