#include "test/simulator/renderer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <random>

#include "test/simulator/path.h"
#include "test/simulator/random.h"

namespace alidade::simulator {
namespace {

constexpr int kMostExposures = 64;
constexpr int kWaves = 24;
constexpr int kSpectrumWaves = 96;  // where correlation is to be as asked for
// Boil is evaluated at every so many columns, and is linear in between.
constexpr int kBoilStep = 16;
constexpr int kBoilStepsPerLength = 2;
constexpr double kCoveredLight = 0.02;  // what comes through a lens cover
// Where in a pixel each sub-exposure looks, in the order of time. Opposite points come at opposite
// times, so that the blur of a moving edge is symmetric; in the larger set, used when motion is to be
// seen, neither coordinate is correlated with time nor with the other, so that the blur has its width.
using Point = std::array<double, 2>;  // px from the pixel's centre
constexpr std::array<Point, 4> kPointsAtRest{
    {{0.125, 0.375}, {-0.375, 0.125}, {0.375, -0.125}, {-0.125, -0.375}}};
constexpr std::array<Point, 8> kPointsInMotion{{{0.0625, 0.1875},
                                                {-0.1875, 0.0625},
                                                {0.3125, -0.4375},
                                                {-0.4375, -0.3125},
                                                {0.4375, 0.3125},
                                                {-0.3125, 0.4375},
                                                {0.1875, -0.0625},
                                                {-0.0625, -0.1875}}};
constexpr double kRestBlur = 1;  // px during the exposure

// A zoom's preparation for one focal length serves from half of it on; a little less, as the lens is no tangent.
constexpr double kServesFrom = 0.45;

double largest_inverse_distance(const SceneConfig& scene) {
  double largest = 0;
  for (const auto* patches : {&scene.moving, &scene.flat, &scene.photos, &scene.procedural}) {
    for (const PatchConfig& patch : *patches) {
      if (patch.distance) largest = std::max(largest, 1 / patch.distance->nearest);
    }
  }
  return largest;
}

// Directions that bound what the camera will see: a grid over the image, all along the path.
std::vector<Sight> all_sights(const Config& config, const Path& path, const CameraModel& camera) {
  constexpr int kTimes = 600;
  constexpr int kZoomTimes = 2400;  // the view changes quickly
  constexpr int kGrid = 4;
  const Zoom* zoom = camera.zoom();
  const int times = zoom != nullptr ? kZoomTimes : kTimes;
  const double length =
      std::max({config.duration, path.period_s(), zoom != nullptr ? zoom->path().period_s() : 0.0});
  std::vector<Sight> sights{{config.camera.focal_length, {}}};
  if (zoom != nullptr) {
    const ZoomConfig::Ends focal_lengths = zoom->focal_lengths();
    sights.front().focal_length = focal_lengths.tele;
    while (sights.back().focal_length >= 2 * focal_lengths.wide) {
      sights.push_back({sights.back().focal_length / 2, {}});
    }
  }
  const Eigen::Vector3d parallax = camera.pupil() * largest_inverse_distance(config.scene);
  for (int i = 0; i <= times; ++i) {
    const double time = length * i / times;
    const Eigen::Matrix3d turn = camera.world_from_camera_at(time);
    const Lens lens = camera.lens_at(time);
    for (int row = 0; row <= kGrid; ++row) {
      for (int column = 0; column <= kGrid; ++column) {
        const double u = config.image.width * column / static_cast<double>(kGrid);
        const double v = config.image.height * row / static_cast<double>(kGrid);
        const Eigen::Vector2d slope = camera.slope_at(u, v, time);
        if (slope.hasNaN()) continue;
        const Eigen::Vector3d d_camera = slope.homogeneous().normalized();
        for (Sight& sight : sights) {
          const bool serves = lens.focal_length >= kServesFrom * sight.focal_length;
          if (!serves && &sight != &sights.back()) continue;
          sight.seen.push_back(turn * d_camera);
          if (!parallax.isZero(0))
            sight.seen.push_back((turn * (d_camera + parallax)).normalized());
        }
      }
    }
  }
  return sights;
}

}  // namespace

Renderer::Renderer(const Config& config, const Path& path)
    : config_(config),
      camera_(config.camera, config.image, path, make_zoom(config)),
      scene_(config.scene, all_sights(config, path, camera_), camera_.zoom() != nullptr,
             config.seed),
      noise_(config.sensor, config.seed) {
  const double length = config.sensor.boil_length;
  const double time = config.sensor.boil_time;
  boil_step_ = length > 0 ? std::clamp(static_cast<int>(length / kBoilStepsPerLength), 1, kBoilStep)
                          : kBoilStep;
  if (config.sensor.boil > 0) {
    std::mt19937_64 generator = make_generator(config.seed, Stream::kBoil);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> turn(0, kTwoPi);
    std::uniform_real_distribution<double> pace(0.5, 1.5);
    const int waves = length > 0 || time > 0 ? kSpectrumWaves : kWaves;
    const double per_px = length > 0 ? 1 / length : kTwoPi / (0.2 * config.image.width);
    for (int i = 0; i < waves; ++i) {
      // A sum of n waves of amplitude a, in directions all round, has a variance of n a^2 / 4 along
      // each axis.
      const double angle = kTwoPi * i / waves;
      const double amplitude = config.sensor.boil * std::sqrt(4.0 / waves);
      waves_.push_back({per_px * normal(generator), per_px * normal(generator),
                        time > 0 ? normal(generator) / time : kTwoPi / 0.5 * pace(generator),
                        turn(generator),
                        amplitude * Eigen::Vector2d(std::cos(angle), std::sin(angle))});
    }
  }
}

bool Renderer::steady() const {
  const auto still = [](const PatchConfig& patch) { return !patch.flutter; };
  const SceneConfig& scene = config_.scene;
  if (scene.clouds || scene.water ||
      !std::all_of(scene.photos.begin(), scene.photos.end(), still) ||
      !std::all_of(scene.procedural.begin(), scene.procedural.end(), still)) {
    return false;
  }
  return !camera_.breathes() && !camera_.sways() && config_.sensor.boil == 0 &&
         config_.scene.moving.empty() && config_.sensor.brightness_steps.empty() &&
         config_.sensor.covered.empty();
}

Eigen::Vector2d Renderer::boil(double u, double v, double time_s) const {
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (const Wave& wave : waves_) {
    sum += wave.amplitude *
           std::sin(wave.along_u * u + wave.along_v * v + wave.along_time * time_s + wave.phase);
  }
  return sum;
}

void Renderer::rays_of_row(const Lens& lens, double v, double offset_u, double time_s,
                           std::vector<double>* x, std::vector<double>* y) const {
  Eigen::Vector2d left = Eigen::Vector2d::Zero();
  Eigen::Vector2d right = boil(0, v, time_s);
  for (int column = 0; column < config_.image.width; ++column) {
    const int within = column % boil_step_;
    if (within == 0) {
      left = right;
      right = boil(column + boil_step_, v, time_s);
    }
    const Eigen::Vector2d shift =
        left + (right - left) * (within / static_cast<double>(boil_step_));
    const double u = column + 0.5 + offset_u + shift.x();
    const Eigen::Vector2d slope = camera_.slope_of(lens, u, v + shift.y());
    (*x)[static_cast<std::size_t>(column)] = slope.x();
    (*y)[static_cast<std::size_t>(column)] = slope.y();
  }
}

double Renderer::light(double time_s) const {
  double factor = 1;
  for (const SensorConfig::Step& step : config_.sensor.brightness_steps) {
    if (time_s >= step.time) factor = step.factor;
  }
  for (const SensorConfig::Interval& covered : config_.sensor.covered) {
    if (time_s >= covered.from && time_s < covered.to) factor *= kCoveredLight;
  }
  return factor;
}

std::vector<std::uint8_t> Renderer::render(double t0_s, std::int64_t sequence) const {
  const SensorConfig& sensor = config_.sensor;
  const int width = config_.image.width;
  const int height = config_.image.height;
  const auto row_size = static_cast<std::size_t>(width);

  const double readout = height * config_.camera.line_delay;
  const double opens = t0_s + readout / 2 - sensor.exposure / 2;
  const double closes = t0_s + readout / 2 + sensor.exposure / 2;
  const Eigen::Matrix3d before = camera_.world_from_camera_at(opens);
  const Eigen::Matrix3d after = camera_.world_from_camera_at(closes);
  const double focal_length = camera_.lens_at(closes).focal_length;
  // The norm of a difference of rotations by the small angle a is sqrt(2) a. Zooming is fastest in the corners.
  const double blur = focal_length * (after - before).norm() / std::sqrt(2.0) +
                      std::abs(focal_length / camera_.lens_at(opens).focal_length - 1) *
                          std::hypot(width, height) / 2;
  const bool rests = blur < kRestBlur;
  const int exposures =
      rests ? 4 : std::min(8 * static_cast<int>(std::ceil(blur / 8)), kMostExposures);

  const double corner_squared = (width * width + height * height) / 4.0;
  std::vector<std::uint8_t> image(row_size * static_cast<std::size_t>(height));
  std::vector<double> x(row_size);
  std::vector<double> y(row_size);
  std::vector<float> signal(row_size);
  std::vector<double> grey(row_size);
  for (int row = 0; row < height; ++row) {
    const double v = row + 0.5;
    const double row_time = t0_s + v * config_.camera.line_delay;
    std::fill(signal.begin(), signal.end(), 0.0F);
    for (int i = 0; i < exposures; ++i) {
      const double time = row_time + sensor.exposure * ((i + 0.5) / exposures - 0.5);
      const auto& [offset_u, offset_v] = rests
                                             ? kPointsAtRest.at(static_cast<std::size_t>(i))
                                             : kPointsInMotion.at(static_cast<std::size_t>(i % 8));
      const Lens lens = camera_.lens_at(time);
      rays_of_row(lens, v + offset_v, offset_u, time, &x, &y);
      scene_.shade(camera_.world_from_camera_at(time), camera_.pupil(), time, lens.focal_length,
                   x.data(), y.data(), row_size, 1.0F / static_cast<float>(exposures),
                   signal.data());
    }

    const double row_light = 255 * light(row_time);
    const double from_axis_v = v - height / 2.0;
    for (int column = 0; column < width; ++column) {
      const auto i = static_cast<std::size_t>(column);
      const double from_axis_u = column + 0.5 - width / 2.0;
      const double r_squared =
          (from_axis_u * from_axis_u + from_axis_v * from_axis_v) / corner_squared;
      // Catmull-Rom overshoots a little at crisp edges; light is not negative.
      grey[i] = std::max(0.0F, signal[i]) * row_light * (1 - sensor.vignetting * r_squared);
    }
    noise_.digitise(sequence, row, grey, image.data() + static_cast<std::size_t>(row) * row_size);
  }
  return image;
}

}  // namespace alidade::simulator
