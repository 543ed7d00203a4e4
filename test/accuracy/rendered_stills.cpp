#include "test/accuracy/rendered_stills.h"
#include "test/accuracy/photos_of_all_scales.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <sstream>
#include <stdexcept>

#include "test/simulator/zoom_curve.h"

namespace alidade::test {
namespace {

// The lens moves for one half of it and stands for the other, in the middle of which the picture is taken.
constexpr double kEach_s = 20;
constexpr int kWidth = 1280;
constexpr int kHeight = 720;

double radians(double degrees) { return degrees * simulator::kTwoPi / 360; }

double time_of(int still) { return (still + 0.75) * kEach_s; }

// Stands at one view after the other; turns where no picture is taken.
class StillPath : public simulator::Path {
 public:
  explicit StillPath(std::vector<StillView> views) : views_(std::move(views)) {}

  [[nodiscard]] simulator::Angles at(double time_s) const override {
    const auto last = static_cast<double>(views_.size() - 1);
    const auto i = static_cast<std::size_t>(std::clamp(std::floor(time_s / kEach_s), 0.0, last));
    return {views_[i].pan, views_[i].tilt};
  }
  [[nodiscard]] double period_s() const override { return 0; }

 private:
  std::vector<StillView> views_;
};

simulator::Config stills_config(const std::vector<StillView>& views, std::uint64_t seed) {
  simulator::Config config;
  config.seed = seed;
  config.image = {kWidth, kHeight, 1 / kEach_s};
  config.duration = kEach_s * static_cast<double>(views.size());
  config.scene.background = 0.6;
  add_photos_of_all_scales(&config);
  simulator::PatchConfig around;
  around.projection = simulator::PatchConfig::Projection::kEquirectangular;
  around.width = radians(170);
  around.height = radians(110);
  config.scene.procedural.push_back(around);
  config.sensor.shot_noise = 0.02;
  config.sensor.read_noise = 1.3;  // 2 with the shots
  simulator::ZoomConfig& zoom = config.zoom.emplace();
  zoom.focal_length = {1200, 24000};
  zoom.distortion = {-0.04, 0.01};
  zoom.centre = {4, -3};
  zoom.centre_wander = 6;
  zoom.sigma_rep = 1e-3;
  zoom.acceleration = 10;
  zoom.speed = 2;
  return config;
}

// Rests at the readings of the views.
void write_zoom_path(const std::vector<StillView>& views, const std::string& file,
                     simulator::Config* config) {
  const simulator::ZoomCurve curve(*config->zoom);
  std::ofstream out(file);
  out << "time_s,zoom\n";
  out.precision(17);
  for (std::size_t i = 0; i < views.size(); ++i) {
    const double reading =
        std::round(curve.reading(curve.part_at(std::log(views[i].focal_length))));
    const double begin_s = static_cast<double>(i) * kEach_s;
    out << begin_s + kEach_s / 2 << "," << reading << "\n"
        << begin_s + kEach_s << "," << reading << "\n";
  }
  if (!out) throw std::runtime_error(file + ": cannot be written");
  config->zoom->path.type = simulator::ZoomPathConfig::Type::kCsv;
  config->zoom->path.file = file;
}

}  // namespace

RenderedStills::RenderedStills(std::vector<StillView> views, std::uint64_t seed,
                               const std::filesystem::path& cache)
    : views_(std::move(views)),
      config_(stills_config(views_, seed)),
      path_(std::make_unique<StillPath>(views_)) {
  std::ostringstream all;
  all.precision(17);
  all << seed;
  for (const StillView& view : views_) {
    all << ' ' << view.pan << ' ' << view.tilt << ' ' << view.focal_length;
  }
  std::ostringstream name;
  name << "stills-" << std::hex << std::hash<std::string>{}(all.str());
  cache_ = cache / name.str();
  std::filesystem::create_directories(cache_);
  write_zoom_path(views_, (cache_ / "zoom.csv").string(), &config_);
  camera_.emplace(config_.camera, config_.image, *path_, simulator::make_zoom(config_));
}

cv::Mat RenderedStills::image(int i) const {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "%06d.png", i);
  const std::string file = (cache_ / name.data()).string();
  if (std::filesystem::exists(file)) {
    cv::Mat kept = cv::imread(file, cv::IMREAD_GRAYSCALE);
    if (!kept.empty()) return kept;
  }
  if (!renderer_) renderer_ = std::make_unique<simulator::Renderer>(config_, *path_);
  std::vector<std::uint8_t> pixels = renderer_->render(time_of(i), i);
  cv::Mat image = cv::Mat(kHeight, kWidth, CV_8U, pixels.data()).clone();
  if (!cv::imwrite(file, image)) throw std::runtime_error(file + ": cannot be written");
  return image;
}

Eigen::Matrix3d RenderedStills::base_from_camera(int i) const {
  return camera_->base_from_camera_at(time_of(i));
}

simulator::Lens RenderedStills::lens(int i) const { return camera_->lens_at(time_of(i)); }

double RenderedStills::zoom_reading(int i) const { return camera_->zoom()->reported(time_of(i)); }

std::vector<StillView> map_views(int columns) {
  const double step = 0.3 * 4 / (columns - 1);  // of a field
  std::vector<StillView> views;
  for (int level = 0; level < kStillLevels; ++level) {
    const double f = kWidestFocalLength_px * std::pow(2, level);
    const double across = 2 * std::atan(kWidth / (2 * f));
    const double down = 2 * std::atan(kHeight / (2 * f));
    for (int row = -1; row <= 1; ++row) {
      const int in_row = row == 0 ? columns : columns - 1;
      for (int column = 0; column < in_row; ++column) {
        // No two of a level at the same: the lens comes to rest anew for each.
        const double off = 1 + 0.004 * (static_cast<double>(views.size() % 3) - 1);
        views.push_back(
            {step * across * (column - (in_row - 1) / 2.0), 0.35 * down * row, f * off});
      }
    }
  }
  return views;
}

std::vector<StillView> random_views(int count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(-1, 1);
  std::vector<StillView> views;
  const double most = std::log(kWidestFocalLength_px * std::pow(2, kStillLevels - 1));
  const double least = std::log(kWidestFocalLength_px);
  for (int i = 0; i < count; ++i) {
    const double f = std::exp((least + most + share(random) * (most - least)) / 2);
    // The level of the next shorter focal length shows all of it.
    const double level = std::floor(std::log2(f / kWidestFocalLength_px));
    const double at = kWidestFocalLength_px * std::pow(2, level);
    const double across = 2 * std::atan(kWidth / (2 * at));
    const double down = 2 * std::atan(kHeight / (2 * at));
    views.push_back({0.45 * across * share(random), 0.3 * down * share(random), f});
  }
  std::sort(views.begin(), views.end(),
            [](const StillView& a, const StillView& b) { return a.focal_length > b.focal_length; });
  return views;
}

}  // namespace alidade::test
