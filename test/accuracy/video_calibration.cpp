#include "test/accuracy/video_calibration.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <system_error>

#include "core/model/direction.h"
#include "edge_app/commands/calibration_input.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/commands/visible_calibration.h"
#include "edge_app/storage/calibration_file.h"
#include "test/accuracy/rendered_recording.h"
#include "test/simulator/recording_writer.h"

namespace alidade::test {
namespace {

namespace fs = std::filesystem;
using PathType = simulator::PathConfig::Type;

struct PathPlan {
  const char* name;
  PathType type;
  double fields_per_second;
  double period_s;
};
constexpr PathPlan kPaths[] = {{"cosine", PathType::kTripleCosine, 0.5, 10},
                               {"sweep", PathType::kSweep, 0.7, 8},
                               {"jerky", PathType::kJerky, 0.7, 16},
                               {"slow", PathType::kTripleCosine, 0.15, 28}};
constexpr const char* kPhotos[] = {
    "picosdeeuropa_by_Aitzol_Berasategi.jpg", "aitzgorri_by_Aitzol_Berasategi.jpg",
    "life_by_Aitzol_Berasategi.jpg", "friends_by_Aitzol_Berasategi.jpg"};
constexpr double kWidths[] = {4.5, 9};  // of a photo, in horizontal fields of view
struct QualityPlan {
  double noise;  // grey levels
  int jpeg;
};
constexpr QualityPlan kQualities[] = {{2, 85}, {3, 75}, {6, 60}};
struct SizePlan {
  int width, height;  // px
  double rate_hz;
  double duration_s;
};
constexpr SizePlan kSizes[] = {{640, 360, 20, 12}, {960, 540, 15, 16}, {1280, 720, 12.5, 20}};
constexpr double kSlowDuration_s = 30;
constexpr double kFields[] = {0.06, 0.17, 0.35, 0.7};         // rad
constexpr double kCornerDistortions[] = {-0.05, 0.03, 0.07};  // k r^2
constexpr double kReadouts[] = {0.6, -0.4, 0.2};              // of a period

// The folder goes with it, however the recording ends.
struct Removed {
  const fs::path& folder;
  ~Removed() {
    std::error_code ignored;
    fs::remove_all(folder, ignored);
  }
};

template <class T, std::size_t kCount>
const T& pick(const T (&all)[kCount], int number) {
  return all[static_cast<std::size_t>(number) % kCount];
}

}  // namespace

VideoRecording video_recording(int number) {
  const int path_number = number / 4;
  const PathPlan& path = pick(kPaths, path_number);
  const QualityPlan& quality = pick(kQualities, number);
  const SizePlan& size = pick(kSizes, number / 3);
  const double field = pick(kFields, number + path_number);
  std::mt19937_64 random(static_cast<std::uint64_t>(number) + 1);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(-1, 1);

  VideoRecording recording;
  simulator::Config& c = recording.config;
  c.seed = static_cast<std::uint64_t>(number) + 1;
  c.image = {size.width, size.height, size.rate_hz};
  const bool slow = path.fields_per_second < 0.3;
  c.duration = slow ? kSlowDuration_s : size.duration_s;
  if (slow) c.image.rate_hz /= 1.5;
  c.camera.focal_length = 0.5 * size.width / std::tan(0.5 * field);
  c.camera.radial_distortion = pick(kCornerDistortions, number / 2) *
                               std::pow(2 * c.camera.focal_length, 2) /
                               (std::pow(size.width, 2) + std::pow(size.height, 2));
  c.camera.line_delay = pick(kReadouts, number / 5) / (c.image.rate_hz * size.height);
  constexpr double kAxisSigma = 0.01;  // rad
  c.camera.pan_axis_offset = {kAxisSigma * normal(random), kAxisSigma * normal(random)};
  c.camera.tilt_axis_offset = {kAxisSigma * normal(random), kAxisSigma * normal(random)};
  c.camera.clock_offset = 0.1 * uniform(random);
  c.path.type = path.type;
  c.path.period = path.period_s;
  set_peak_speed(path.fields_per_second, &c);
  simulator::PatchConfig photo;
  photo.file = fs::path(ALIDADE_TEST_DATA) / pick(kPhotos, number);
  // Near and afar in turns: each photo on each path, from sixteen to sixteen.
  photo.width = std::min(pick(kWidths, number + path_number + number / 16) * field, 2.7);
  c.scene.photos.push_back(photo);
  c.scene.detail = 0.5;
  c.sensor.exposure = 2e-3;
  c.sensor.read_noise = quality.noise;
  c.sensor.jpeg_quality = quality.jpeg;
  c.sensor.vignetting = 0.1;
  c.telemetry.rate_hz = 40;
  c.telemetry.sigma = 1 / c.camera.focal_length;
  c.timing.image.sigma = c.timing.telemetry.sigma = 1e-3;
  c.timing.image_period_sigma = c.timing.telemetry_period_sigma = 2e-5;
  recording.name = std::to_string(number) + " " + path.name + " " + std::to_string(size.width) +
                   " noise " + std::to_string(static_cast<int>(quality.noise));
  return recording;
}

std::optional<VideoErrors> calibrate_video_recording(const VideoRecording& recording,
                                                     const fs::path& folder, std::string* error) {
  VideoErrors errors;
  const Removed removed{folder};
  try {
    simulator::write_recording(recording.config, folder);
    CalibrationJob job = load_calibration_jobs(folder.string()).front();
    StopSignals signals;
    const CalibrationResult result = calibrate_job(2, &job, &signals);
    Calibration truth;
    const bool read = load_calibration((folder / "truth.yaml").string(), &truth, error);
    if (!read) return std::nullopt;
    if (!result.ok()) {
      *error = result.message;
      return std::nullopt;
    }
    const Calibration& c = result.calibration;
    const Vector2<double> pan =
        direction_minus<double>(truth.mechanics.pan_axis, c.mechanics.pan_axis);
    const Vector2<double> tilt =
        direction_minus<double>(truth.mechanics.tilt_axis, c.mechanics.tilt_axis);
    errors.plain = {c.camera.focal_length - truth.camera.focal_length,
                    c.camera.distortion.radial - truth.camera.distortion.radial,
                    c.line_delay - truth.line_delay,
                    pan.x(),
                    pan.y(),
                    tilt.x(),
                    tilt.y(),
                    c.clock_offset - truth.clock_offset};
    for (std::size_t i = 0; i < errors.plain.size(); ++i) {
      errors.normalised[i] = errors.plain[i] / parameter_sigma(c, kComparedParameters[i]);
    }
  } catch (const CommandError& problem) {
    *error = problem.what();
    return std::nullopt;
  }
  return errors;
}

}  // namespace alidade::test
