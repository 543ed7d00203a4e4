#include "test/accuracy/motion_film.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <random>
#include <stdexcept>

#include "test/simulator/random.h"

namespace alidade::test {
namespace {

constexpr double kFocalLength = 32008.0 * 1280 / 1920;  // px
constexpr double kExposure_s = 2e-3;
constexpr int kExposures = 5;
constexpr int kFine = 8;  // points a pixel, each way
constexpr double kLeastSpeed_px = 20;
constexpr double kMostSpeed_px = 150;
constexpr double kMargin_px = 2;  // of a target that counts, from the picture's edge
constexpr double kApart_px = 24;  // of targets that count

// Pan at constant speed, tilt too, ten times more slowly.
std::filesystem::path write_path(double fields_per_second, double duration_s, double field,
                                 const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const std::filesystem::path file = folder / ("pan_" + std::to_string(fields_per_second) + "_" +
                                               std::to_string(duration_s) + ".csv");
  std::ofstream out(file);
  out.precision(12);
  out << "time_s,pan_rad,tilt_rad\n";
  for (double t = -1; t <= duration_s + 1; t += 0.05) {
    const double from_middle = (t - duration_s / 2) * fields_per_second * field;
    out << t << "," << from_middle << "," << 0.1 * from_middle << "\n";
  }
  if (!out) throw std::runtime_error(file.string() + ": cannot be written");
  return file;
}

simulator::Config config_of(const MotionFilmPlan& plan, const std::filesystem::path& kept) {
  simulator::Config config;
  config.seed = plan.seed;
  config.duration = plan.duration_s;
  config.image = {1280, 720, 25};
  config.camera.focal_length = kFocalLength;
  config.camera.radial_distortion = 55.4;
  config.camera.line_delay = -14.2e-6;
  config.camera.pan_axis_offset = {-12e-3, 0};
  config.camera.tilt_axis_offset = {0, 14e-3};
  const double field = simulator::horizontal_field_of_view(config);
  if (plan.back_and_forth) {
    config.path.type = simulator::PathConfig::Type::kTripleCosine;
    config.path.period = plan.duration_s;
    set_peak_speed(plan.fields_per_second, &config);
  } else {
    config.path.type = simulator::PathConfig::Type::kCsv;
    config.path.file = write_path(plan.fields_per_second, plan.duration_s, field, kept);
  }
  config.telemetry.rate_hz = 40;
  config.telemetry.sigma = 1e-5;
  config.sensor.exposure = kExposure_s;
  simulator::PatchConfig patch;
  patch.file = plan.photo;
  patch.width = 4.5 * field;
  patch.height = 0.75 * patch.width;
  (plan.photo.empty() ? config.scene.procedural : config.scene.photos).push_back(patch);
  return config;
}

}  // namespace

MotionFilm::MotionFilm(const MotionFilmPlan& plan, const std::filesystem::path& kept)
    : plan_(plan),
      recording_(std::make_unique<RenderedRecording>(plan.name, config_of(plan, kept), kept)) {
  // Over all that comes into view, as dense as a view of it has to be.
  const simulator::Config& config = recording_->config();
  const double field = simulator::horizontal_field_of_view(config);
  const double high = field * config.image.height / config.image.width;
  double least = 1e9, most = -1e9, lowest = 1e9, highest = -1e9;
  for (int i = 0; i < size(); ++i) {
    const simulator::Angles at = recording_->angles(time_s(i));
    least = std::min(least, at.pan - field / 2);
    most = std::max(most, at.pan + field / 2);
    lowest = std::min(lowest, at.tilt - high / 2);
    highest = std::max(highest, at.tilt + high / 2);
  }
  const double views = (most - least) * (highest - lowest) / (field * high);
  const int count = static_cast<int>(std::lround(plan.targets * views));
  std::mt19937_64 random(plan.seed * 7919 + 13);
  const auto between = [&random](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  for (int i = 0; i < count; ++i) {
    const double speed = between(kLeastSpeed_px, kMostSpeed_px) / kFocalLength;
    const double heading = between(0, simulator::kTwoPi);
    Mover mover{};
    mover.pan_rate = speed * std::cos(heading);
    mover.tilt_rate = speed * std::sin(heading);
    // There at the film's middle.
    mover.pan = between(least, most) - mover.pan_rate * plan.duration_s / 2;
    mover.tilt = between(lowest, highest) - mover.tilt_rate * plan.duration_s / 2;
    mover.brighter = (i % 2 == 0 ? 1 : -1) * plan.contrast;
    movers_.push_back(mover);
  }
}

bool MotionFilm::place_at(const Mover& mover, double time_s, Eigen::Vector2d* u) const {
  // The direction in which a camera at these angles would look.
  const Eigen::Matrix3d towards = recording_->camera().base_from_camera(
      {mover.pan + mover.pan_rate * time_s, mover.tilt + mover.tilt_rate * time_s});
  const Eigen::Vector3d d_camera =
      recording_->base_from_camera(time_s).transpose() * towards.col(2);
  const auto projected = recording_->camera().project(d_camera);
  if (!projected) return false;
  *u = *projected;
  return true;
}

bool MotionFilm::place_in(const Mover& mover, int frame, double shift_s, Eigen::Vector2d* u) const {
  double row = 0;
  for (int step = 0; step < 4; ++step) {
    const double time = time_s(frame) + row * recording_->config().camera.line_delay + shift_s;
    if (!place_at(mover, time, u)) return false;
    row = u->y();
  }
  return true;
}

void MotionFilm::paint(const Mover& mover, int frame, cv::Mat* image) const {
  Eigen::Vector2d centre;
  if (!place_in(mover, frame, 0, &centre)) return;
  const double radius = plan_.size_px / 2;
  const int reach = static_cast<int>(std::ceil(radius)) + 6;
  const cv::Rect around =
      cv::Rect(static_cast<int>(std::floor(centre.x())) - reach,
               static_cast<int>(std::floor(centre.y())) - reach, 2 * reach + 1, 2 * reach + 1) &
      cv::Rect(0, 0, image->cols, image->rows);
  if (around.empty()) return;
  cv::Mat share = cv::Mat::zeros(around.height, around.width, CV_32F);
  for (int k = 0; k < kExposures; ++k) {
    Eigen::Vector2d place;
    const double shift = ((k + 0.5) / kExposures - 0.5) * kExposure_s;
    if (!place_in(mover, frame, shift, &place)) return;
    for (int v = 0; v < around.height; ++v) {
      for (int u = 0; u < around.width; ++u) {
        int inside = 0;
        for (int j = 0; j < kFine; ++j) {
          for (int i = 0; i < kFine; ++i) {
            const double x = around.x + u + (i + 0.5) / kFine - place.x();
            const double y = around.y + v + (j + 0.5) / kFine - place.y();
            if (x * x + y * y < radius * radius) ++inside;
          }
        }
        share.at<float>(v, u) += static_cast<float>(inside) / (kFine * kFine * kExposures);
      }
    }
  }
  double behind = 0;
  double weight = 1e-9;
  for (int v = 0; v < around.height; ++v) {
    for (int u = 0; u < around.width; ++u) {
      behind += share.at<float>(v, u) * image->at<std::uint8_t>(around.y + v, around.x + u);
      weight += share.at<float>(v, u);
    }
  }
  double grey = behind / weight + mover.brighter;
  // As much to the other side where white or black is near.
  if (grey < 0 || grey > 255) grey = behind / weight - mover.brighter;
  for (int v = 0; v < around.height; ++v) {
    for (int u = 0; u < around.width; ++u) {
      auto& pixel = image->at<std::uint8_t>(around.y + v, around.x + u);
      const double part = share.at<float>(v, u);
      pixel = cv::saturate_cast<std::uint8_t>((1 - part) * pixel + part * grey);
    }
  }
}

cv::Mat MotionFilm::image(int frame) const {
  const bool still = plan_.fields_per_second == 0;
  cv::Mat image = recording_->image(still ? 0 : frame, FrameNoise::kNone);
  for (const Mover& mover : movers_) paint(mover, frame, &image);
  std::mt19937_64 random(simulator::mix(plan_.seed + 1000, static_cast<std::uint64_t>(frame)));
  std::normal_distribution<float> normal(0, static_cast<float>(std::max(plan_.noise, 1e-9)));
  for (int v = 0; v < image.rows; ++v) {
    auto* row = image.ptr<std::uint8_t>(v);
    for (int u = 0; u < image.cols; ++u) {
      row[u] = cv::saturate_cast<std::uint8_t>(static_cast<float>(row[u]) + normal(random));
    }
  }
  if (plan_.jpeg_quality == 0) return image;
  std::vector<std::uint8_t> coded;
  cv::imencode(".jpg", image, coded, {cv::IMWRITE_JPEG_QUALITY, plan_.jpeg_quality});
  return cv::imdecode(coded, cv::IMREAD_GRAYSCALE);
}

std::vector<TrueTarget> MotionFilm::truth(int frame) const {
  const simulator::ImageConfig& size = recording_->config().image;
  std::vector<TrueTarget> all;
  const double margin = plan_.size_px / 2 + kMargin_px;
  for (const Mover& mover : movers_) {
    Eigen::Vector2d u;
    if (!place_in(mover, frame, 0, &u)) continue;
    if (u.x() < -margin || u.y() < -margin || u.x() > size.width + margin ||
        u.y() > size.height + margin) {
      continue;
    }
    const bool whole = u.x() >= margin && u.y() >= margin && u.x() <= size.width - margin &&
                       u.y() <= size.height - margin;
    all.push_back({u, plan_.size_px, whole});
  }
  for (TrueTarget& a : all) {
    for (TrueTarget& b : all) {
      if (&a != &b && (a.centre - b.centre).norm() < plan_.size_px + kApart_px) {
        a.counts = b.counts = false;
      }
    }
  }
  return all;
}

FrameOrientation MotionFilm::orientation(int frame) const {
  const Calibration calibration = recording_->calibration();
  constexpr double h = 1e-3;
  const double middle = 0.5 * calibration.camera.height;
  const double t = time_s(frame) + calibration.line_delay * middle;
  const simulator::Angles before = recording_->angles(t - h);
  const simulator::Angles now = recording_->angles(t);
  const simulator::Angles after = recording_->angles(t + h);
  std::mt19937_64 random(simulator::mix(plan_.seed + 2000, static_cast<std::uint64_t>(frame)));
  std::normal_distribution<double> normal;
  const double sigma = plan_.sigma_orientation_px / calibration.camera.focal_length;
  const double sigma_rate = sigma / std::abs(calibration.line_delay * middle);
  FrameMotion<double> motion;
  motion.reference_row = middle;
  motion.angle = {now.pan + sigma * normal(random), now.tilt + sigma * normal(random)};
  motion.rate = {(after.pan - before.pan) / (2 * h) + sigma_rate * normal(random),
                 (after.tilt - before.tilt) / (2 * h) + sigma_rate * normal(random)};
  MotionCovariance covariance = MotionCovariance::Zero();
  covariance.diagonal() << sigma * sigma, sigma * sigma, sigma_rate * sigma_rate,
      sigma_rate * sigma_rate, 0, 0;
  FrameOrientation out;
  if (!make_frame_orientation(calibration, time_s(frame), OrientationMode::kOe, 100, motion,
                              covariance, telemetry_sensitivity(calibration.mechanics, motion),
                              &out)) {
    throw std::runtime_error("an orientation that is not finite");
  }
  return out;
}

}  // namespace alidade::test
