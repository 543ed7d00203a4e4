#pragma once
// The virtual camera behind a lens that zooms, frame by frame: images, telemetry with the errors that it states, and what a zoom
// reading and a zoom curve tell of the lens. The curve is the lens' own but for its repeatability, and for errors of distortion and
// centre that are the same at all readings, drawn from what the curve says of them.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/model/trigonometry.h"
#include "core/realtime/frame_orientation.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/lens/frame_lens.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"
#include "test/simulator/renderer.h"

namespace alidade::test {

inline constexpr double kTwoOctavesRepeatability = 2e-3;

// From 1000 to 4000 px in 2.7 s, at rest before and after, the picture upside down; 480x270.
inline simulator::Config two_octaves() {
  constexpr double kRest_s = 1.2;
  simulator::Config config;
  config.image = {480, 270, 25};
  config.camera.line_delay = -40e-6;
  config.duration = 10;
  for (const auto& [name, azimuth, width] :
       {std::tuple{"life_by_Aitzol_Berasategi.jpg", -0.5, 7.0},
        std::tuple{"picosdeeuropa_by_Aitzol_Berasategi.jpg", 0.0, 60.0}}) {
    simulator::PatchConfig photo;
    photo.file = std::string(ALIDADE_TEST_DATA "/") + name;
    photo.azimuth = azimuth * kPi / 180;
    photo.width = width * kPi / 180;
    config.scene.photos.push_back(photo);
  }
  config.sensor.exposure = 1e-3;
  config.sensor.shot_noise = 0.02;
  config.sensor.read_noise = 0.7;
  simulator::ZoomConfig& zoom = config.zoom.emplace();
  zoom.focal_length = {1000, 8000};
  zoom.sigma_rep = kTwoOctavesRepeatability;
  zoom.distortion = {-0.02, 0.01};
  zoom.centre = {2, -1};
  zoom.centre_wander = 3;
  zoom.speed = 0.6;
  zoom.acceleration = 2.5;
  zoom.path.type = simulator::ZoomPathConfig::Type::kDwell;
  zoom.path.stops = {{std::nullopt, 1000, kRest_s}, {std::nullopt, 4000, kRest_s}};
  return config;
}

// Turns about (0, 0) so fast that it crosses up to `fields` fields of view a second, those of the lens at that time.
class ZoomedPath : public simulator::Path {
 public:
  ZoomedPath(const simulator::Config& config, double fields, double period_s) {
    const simulator::Zoom zoom(config);
    const auto steps = static_cast<std::size_t>(config.duration / kStep_s) + 2;
    angles_.resize(steps);
    const double phase = 0.3 * static_cast<double>(config.seed);
    for (std::size_t i = 1; i < steps; ++i) {
      const double t = (static_cast<double>(i) - 0.5) * kStep_s;
      const double field = config.image.width / zoom.nominal_lens(zoom.reading(t)).focal_length;
      const double turn = simulator::kTwoPi * t / period_s + phase;
      angles_[i] = {angles_[i - 1].pan + kStep_s * fields * field * std::sin(turn),
                    angles_[i - 1].tilt + kStep_s * 0.3 * fields * field * std::cos(1.7 * turn)};
    }
  }

  // A cubic through four of the table.
  [[nodiscard]] simulator::Angles at(double time_s) const override {
    const double position =
        std::clamp(time_s / kStep_s, 1.0, static_cast<double>(angles_.size()) - 2.001);
    const auto i = static_cast<std::size_t>(position);
    const double t = time_s / kStep_s - static_cast<double>(i);
    const auto blend = [t](double a, double b, double c, double d) {
      const double slope_b = (c - a) / 2;
      const double slope_c = (d - b) / 2;
      const double h = 1 - t;
      return b * (1 + 2 * t) * h * h + slope_b * t * h * h + c * t * t * (3 - 2 * t) -
             slope_c * t * t * h;
    };
    const simulator::Angles* p = &angles_[i - 1];
    return {blend(p[0].pan, p[1].pan, p[2].pan, p[3].pan),
            blend(p[0].tilt, p[1].tilt, p[2].tilt, p[3].tilt)};
  }
  [[nodiscard]] double period_s() const override { return 0; }

 private:
  static constexpr double kStep_s = 5e-3;
  std::vector<simulator::Angles> angles_;
};

class ZoomingCamera {
 public:
  // config: with a zoom. curve_errors: times what is drawn.
  ZoomingCamera(const simulator::Config& config, std::unique_ptr<simulator::Path> path,
                double curve_errors = 1)
      : config_(config),
        path_(std::move(path)),
        renderer_(config, *path_),
        random_(config.seed),
        corner_error_px_(curve_errors * kCorner_px * normal_(random_)),
        centre_error_px_(curve_errors * draw_centre_error()) {}

  [[nodiscard]] const simulator::CameraModel& camera() const { return renderer_.camera(); }
  [[nodiscard]] double time_s(int k) const { return k / config_.image.rate_hz; }
  [[nodiscard]] int frames() const {
    return static_cast<int>(config_.duration * config_.image.rate_hz);
  }
  [[nodiscard]] double middle_s(int k) const {
    return time_s(k) + config_.camera.line_delay * config_.image.height / 2;
  }
  [[nodiscard]] double line_delay() const { return config_.camera.line_delay; }
  [[nodiscard]] std::vector<std::uint8_t> image(int k) const {
    return renderer_.render(time_s(k), k);
  }
  [[nodiscard]] ImageView view(const std::vector<std::uint8_t>& image) const {
    return {image.data(), config_.image.width, config_.image.height, config_.image.width};
  }

  [[nodiscard]] InterpolatedPanTilt telemetry(int k, double angle_sigma, double rate_sigma) {
    constexpr double h = 1e-3;  // s
    const double t = middle_s(k);
    const simulator::Angles before = path_->at(t - h);
    const simulator::Angles now = path_->at(t);
    const simulator::Angles after = path_->at(t + h);
    const auto noise = [&](double sigma) { return sigma * normal_(random_); };
    InterpolatedPanTilt out;
    out.time_s = time_s(k);
    out.angle = {now.pan + noise(angle_sigma), now.tilt + noise(angle_sigma)};
    out.rate = {(after.pan - before.pan) / (2 * h) + noise(rate_sigma),
                (after.tilt - before.tilt) / (2 * h) + noise(rate_sigma)};
    out.covariance.diagonal() << angle_sigma * angle_sigma, angle_sigma * angle_sigma,
        rate_sigma * rate_sigma, rate_sigma * rate_sigma;
    const Vector2<double> acceleration((after.pan - 2 * now.pan + before.pan) / (h * h),
                                       (after.tilt - 2 * now.tilt + before.tilt) / (h * h));
    out.acceleration_square = acceleration.cwiseAbs2();
    out.samples = 2;
    return out;
  }

  [[nodiscard]] simulator::Angles angles_at(double t) const { return path_->at(t); }

  // Of what is told at that time; sigma: of log f.
  [[nodiscard]] Calibration curve_at(double told_s, double sigma) const {
    return curve_of(camera().zoom()->reading(told_s), sigma);
  }
  [[nodiscard]] Calibration curve_of(double reading, double sigma) const {
    const simulator::Lens lens = camera().zoom()->nominal_lens(reading);
    Calibration out;
    out.camera = {lens.focal_length,
                  lens.aspect,
                  {lens.radial_distortion},
                  config_.image.width,
                  config_.image.height,
                  lens.centre.x() - config_.image.width / 2.0,
                  lens.centre.y() - config_.image.height / 2.0};
    out.line_delay = config_.camera.line_delay;
    out.zoom = reading;
    const auto set = [&out](Parameter p, double s) { out.covariance(index(p), index(p)) = s * s; };
    set(Parameter::kFocalLength, sigma * lens.focal_length);
    const double corner = std::hypot(config_.image.width, config_.image.height) / 2;
    const double k_of_px = std::pow(lens.focal_length / corner, 2) / corner;
    set(Parameter::kRadialDistortion, kCorner_px * k_of_px);
    set(Parameter::kCentreU, kCentre_px);
    set(Parameter::kCentreV, kCentre_px);
    out.camera.distortion.radial += corner_error_px_ * k_of_px;
    out.camera.set_centre_offset(out.camera.centre_offset() + centre_error_px_);
    return out;
  }
  // As it is known without the image, for a reading of that frame's middle row, or of another time.
  [[nodiscard]] FrameLens lens(int k, double sigma) const { return lens_at(middle_s(k), sigma); }
  [[nodiscard]] FrameLens lens_at(double told_s, double sigma) const {
    const double t = std::max(0.0, told_s);
    constexpr double h = 2e-2;  // s
    FrameLens out;
    out.calibration = curve_at(t, sigma);
    out.rate = std::log(curve_at(t + h, sigma).camera.focal_length /
                        curve_at(t - h, sigma).camera.focal_length) /
               (2 * h);
    out.rate_sigma = 0.1;
    const simulator::Zoom& zoom = *camera().zoom();
    const double before_s = std::max(0.0, t - 1.5 / config_.image.rate_hz);
    out.moves = zoom.reading(t + h) != zoom.reading(before_s);
    if (!out.moves) out.rate = 0;
    set_slopes(&out);
    return out;
  }
  // As told by readings in steps of `quantum`, device units.
  [[nodiscard]] FrameLens coarse_lens(int k, double quantum, double sigma) const {
    const double first = config_.zoom->reading.wide;
    const double last = config_.zoom->reading.tele;
    const auto told = [&](double t) {
      const double z = camera().zoom()->reading(std::max(0.0, t));
      return std::clamp(first + quantum * std::round((z - first) / quantum), first, last);
    };
    const double reading = told(middle_s(k));
    const double step =
        std::log(curve_of(std::min(last, reading + quantum / 2), 0).camera.focal_length /
                 curve_of(std::max(first, reading - quantum / 2), 0).camera.focal_length);
    FrameLens out;
    out.calibration = curve_of(reading, std::hypot(sigma, step / std::sqrt(12.0)));
    out.moves = reading != told(middle_s(k) - 1.5 / config_.image.rate_hz);
    out.rate_sigma = 1;
    set_slopes(&out);
    return out;
  }

  [[nodiscard]] double reading_of(double focal_length) const {
    const simulator::Zoom& zoom = *camera().zoom();
    double low = config_.zoom->reading.wide;
    double high = config_.zoom->reading.tele;
    for (int step = 0; step < 40; ++step) {
      const double middle = (low + high) / 2;
      (zoom.nominal_lens(middle).focal_length < focal_length ? low : high) = middle;
    }
    return low;
  }
  // As the curve has it where it has this focal length.
  [[nodiscard]] FrameLens lens_of_focal_length(double focal_length, double sigma) const {
    FrameLens out;
    out.calibration = curve_of(reading_of(focal_length), sigma);
    out.rate_sigma = 1;
    out.moves = true;
    set_slopes(&out);
    return out;
  }

  // Where a direction in base is seen in frame k; beyond the image's border as if rows went on there. row: near it.
  [[nodiscard]] std::optional<Vector2<double>> true_pixel(int k, const Vector3<double>& d_base,
                                                          double row) const {
    if (const auto seen = camera().project_rolling(d_base, time_s(k))) return *seen;
    std::optional<Eigen::Vector2d> seen;
    // A row's shift by the turn within the read-out is a small part of a row.
    for (int step = 0; step < 8; ++step) {
      const double time = time_s(k) + row * line_delay();
      seen =
          camera().lens_at(time).project(camera().base_from_camera_at(time).transpose() * d_base);
      if (!seen) return std::nullopt;
      row = seen->y();
    }
    return *seen;
  }
  // Log of the frame's focal length over the true one, at row 0.
  [[nodiscard]] double log_error(int k, const FrameOrientation& frame) const {
    return std::log(frame.calibration.camera.focal_length /
                    camera().lens_at(time_s(k)).focal_length);
  }

 private:
  void set_slopes(FrameLens* lens) const {
    constexpr double kStep = 5;  // device units
    const double z = *lens->calibration.zoom;
    const Camera<double> from = curve_of(std::max(config_.zoom->reading.wide, z - kStep), 0).camera;
    const Camera<double> to = curve_of(std::min(config_.zoom->reading.tele, z + kStep), 0).camera;
    const double change = std::log(to.focal_length / from.focal_length);
    lens->corner_by_zoom = (corner_distortion(to) - corner_distortion(from)) / change;
    lens->centre_by_zoom = (to.centre_offset() - from.centre_offset()) / change;
  }

  // One after the other: of two arguments each compiler draws another one first, which would be another film.
  [[nodiscard]] Vector2<double> draw_centre_error() {
    Vector2<double> out;
    out.y() = kCentre_px * normal_(random_);
    out.x() = kCentre_px * normal_(random_);
    return out;
  }

  simulator::Config config_;
  std::unique_ptr<simulator::Path> path_;
  simulator::Renderer renderer_;
  static constexpr double kCorner_px = 0.1;
  static constexpr double kCentre_px = 0.2;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  double corner_error_px_;  // by the distortion
  Vector2<double> centre_error_px_;
};

// Of a frame's directions, over the image.
struct FrameErrors {
  double rms_px = 0;      // what is left when the directions are turned to fit at the best
  double sigmas = 0;      // the largest of all, by its covariance, nothing taken out
  double log_sigmas = 0;  // of the focal length
};

inline FrameErrors errors_of(const ZoomingCamera& camera, int k, const FrameOrientation& frame) {
  constexpr int kColumns = 9;
  constexpr int kRows = 7;
  const Vector2<double> size(frame.calibration.camera.width, frame.calibration.camera.height);
  Matrix3<double> N = Matrix3<double>::Zero();
  Vector3<double> b = Vector3<double>::Zero();
  std::vector<std::pair<Matrix<double, 2, 3>, Vector2<double>>> points;
  FrameErrors out;
  for (int row = 0; row < kRows; ++row) {
    for (int column = 0; column < kColumns; ++column) {
      const Vector2<double> u((0.02 + 0.96 * column / (kColumns - 1)) * size.x(),
                              (0.02 + 0.96 * row / (kRows - 1)) * size.y());
      Vector3<double> d;
      EXPECT_EQ(frame.direction(u, &d), ProjectionStatus::kOk);
      const std::optional<Eigen::Vector2d> true_u = camera.true_pixel(k, d, u.y());
      if (!true_u) {
        // So far off that the lens has no place for it.
        out.sigmas = std::numeric_limits<double>::infinity();
        continue;
      }
      const Vector2<double> e = *true_u - u;
      Matrix<double, 2, 3> J;  // of a turn: along u, along v, about the axis
      const Vector2<double> from_middle = (u - size / 2) / size.x();
      J << 1, 0, -from_middle.y(), 0, 1, from_middle.x();
      N += J.transpose() * J;
      b += J.transpose() * e;
      points.emplace_back(J, e);
      Vector2<double> back;
      Matrix2<double> covariance;
      EXPECT_EQ(frame.pixel(d, &back, &covariance), ProjectionStatus::kOk);
      out.sigmas = std::max(out.sigmas, std::sqrt(e.dot(covariance.inverse() * e)));
    }
  }
  const Vector3<double> turn = N.inverse() * b;
  for (const auto& [J, e] : points) {
    out.rms_px += (e - J * turn).squaredNorm() / static_cast<double>(points.size());
  }
  out.rms_px = std::sqrt(out.rms_px);
  const int of_f = index(Parameter::kFocalLength);
  out.log_sigmas = std::abs(camera.log_error(k, frame)) * frame.calibration.camera.focal_length /
                   std::sqrt(frame.calibration.covariance(of_f, of_f));
  return out;
}

}  // namespace alidade::test
