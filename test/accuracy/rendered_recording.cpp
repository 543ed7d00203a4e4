#include "test/accuracy/rendered_recording.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <iomanip>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <sstream>
#include <stdexcept>

#include "test/simulator/parallel.h"
#include "test/simulator/random.h"
#include "test/simulator/telemetry.h"

namespace alidade::test {
namespace {

using simulator::Config;

// Telemetry begins that long before the first frame and ends that long after the last, s.
constexpr double kTelemetryMargin = 1;

Config without_noise(Config config) {
  config.sensor.read_noise = 0;
  config.sensor.shot_noise = 0;
  return config;
}

TelemetryNoise telemetry_noise(const Config& config) {
  TelemetryNoise noise;
  noise.pan_tilt_sigma = config.telemetry.sigma;
  noise.resolution = config.telemetry.quantum;
  noise.period_sigma_s = 0;
  // rad/s^2: what the paths here do, which are told in fields of view.
  noise.acceleration_sigma = 2 * simulator::horizontal_field_of_view(config);
  return noise;
}

}  // namespace

ImageView view_of(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)};
}

void set_peak_speed(double fields_per_second, Config* config) {
  config->path.amplitude = 1;
  const auto path = simulator::make_path(*config);
  constexpr int kSteps = 20000;
  const double step = path->period_s() / kSteps;
  double peak = 0;
  for (int i = 0; i < kSteps; ++i) {
    const simulator::Angles a = path->at(i * step);
    const simulator::Angles b = path->at((i + 1) * step);
    peak = std::max(peak, std::hypot(b.pan - a.pan, b.tilt - a.tilt) / step);
  }
  config->path.amplitude = fields_per_second * simulator::horizontal_field_of_view(*config) / peak;
}

RenderedRecording::RenderedRecording(std::string name, const Config& config,
                                     const std::filesystem::path& cache)
    : name_(std::move(name)),
      config_(config),
      frames_(static_cast<int>(std::lround(config.duration * config.image.rate_hz))),
      path_(simulator::make_path(config)),
      camera_(config.camera, config.image, *path_, simulator::make_zoom(config)),
      renderer_(std::make_unique<simulator::Renderer>(without_noise(config), *path_)),
      telemetry_(telemetry_noise(config)),
      kept_(name_, image_key(config), cache) {
  simulator::Telemetry head(config, *path_);
  const int samples = static_cast<int>(
      std::ceil((config.duration + 2 * kTelemetryMargin) * config.telemetry.rate_hz));
  for (int i = 0; i <= samples; ++i) {
    const double time = i / config.telemetry.rate_hz - kTelemetryMargin;
    const simulator::Angles measured = head.measure(time);
    const TelemetrySample sample{time + config.camera.clock_offset, 0, measured.pan, measured.tilt};
    if (telemetry_.push(sample) != PushStatus::kStored) {
      throw simulator::ConfigError("telemetry that has no noise or too many samples");
    }
  }
}

cv::Mat RenderedRecording::rendered(int frame) const {
  return kept_.frame(frame, [&] {
    std::vector<std::uint8_t> pixels = renderer_->render(time(frame), frame);
    return cv::Mat(config_.image.height, config_.image.width, CV_8U, pixels.data()).clone();
  });
}

cv::Mat RenderedRecording::image(int frame, FrameNoise noise) const {
  cv::Mat image = rendered(frame);
  if (noise == FrameNoise::kNone) return image;
  if (config_.sensor.read_noise > 0) {
    using simulator::Stream;
    std::mt19937_64 generator(
        simulator::mix(simulator::mix(config_.seed, static_cast<std::uint64_t>(Stream::kPixel)),
                       static_cast<std::uint64_t>(frame)));
    std::normal_distribution<float> normal(0, static_cast<float>(config_.sensor.read_noise));
    for (int v = 0; v < image.rows; ++v) {
      auto* row = image.ptr<std::uint8_t>(v);
      for (int u = 0; u < image.cols; ++u) {
        const float grey = static_cast<float>(row[u]) + normal(generator);
        row[u] = static_cast<std::uint8_t>(std::clamp(grey + 0.5F, 0.0F, 255.0F));
      }
    }
  }
  if (config_.sensor.jpeg_quality == 0) return image;
  std::vector<std::uint8_t> coded;
  cv::imencode(".jpg", image, coded, {cv::IMWRITE_JPEG_QUALITY, config_.sensor.jpeg_quality});
  return cv::imdecode(coded, cv::IMREAD_GRAYSCALE);
}

std::vector<cv::Mat> RenderedRecording::images(FrameNoise noise) const {
  std::vector<cv::Mat> all(static_cast<std::size_t>(frames_));
  simulator::parallel_for(all.size(),
                          [&](std::size_t i) { all[i] = image(static_cast<int>(i), noise); });
  return all;
}

Calibration RenderedRecording::calibration() const {
  Calibration calibration;
  calibration.camera = {config_.camera.focal_length,
                        config_.camera.aspect,
                        {config_.camera.radial_distortion},
                        config_.image.width,
                        config_.image.height};
  calibration.line_delay = config_.camera.line_delay;
  calibration.mechanics = {camera_.pan_axis(), camera_.tilt_axis(), config_.camera.pan_scale,
                           config_.camera.tilt_scale};
  calibration.clock_offset = config_.camera.clock_offset;
  return calibration;
}

QueryStatus RenderedRecording::telemetry(const Calibration& calibration, int frame,
                                         InterpolatedPanTilt* out) const {
  const double to_middle_row = calibration.line_delay * 0.5 * calibration.camera.height;
  return telemetry_.query(time(frame) + calibration.clock_offset + to_middle_row, 0, out);
}

}  // namespace alidade::test
