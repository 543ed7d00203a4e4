#pragma once
// A small virtual camera that swings before mountains, and telemetry with the errors that it states.

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <memory>
#include <random>
#include <utility>
#include <vector>

#include "core/realtime/oe_mode/oe_options.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"
#include "test/simulator/renderer.h"
#include "test/support/frame_errors.h"
#include "test/support/mountains.h"

namespace alidade::test {

inline constexpr int kWidth = 480;
inline constexpr int kHeight = 270;
inline constexpr double kFocalLength = 1500;  // px
inline constexpr double kRateHz = 25;
inline constexpr double kPixel = 1 / kFocalLength;  // rad

inline OeOptions small_options() {
  OeOptions options;
  options.max_width = kWidth;
  options.max_height = kHeight;
  options.max_landmarks = 2000;
  options.maker.cell_size_px = 24;
  return options;
}

inline simulator::Config swinging_camera() {
  simulator::Config config = camera_before_mountains({kWidth, kHeight, kRateHz}, kFocalLength);
  config.duration = 10;
  config.path.amplitude = 0.25;
  config.path.period = 6;
  return config;
}

// The standard deviations of one telemetry answer.
struct Sigmas {
  double angle = 1 * kPixel;
  double rate = 5 * kPixel;
};

// Renders each frame once, for all who ask for it.
class Film {
 public:
  explicit Film(const simulator::Config& config)
      : path_(simulator::make_path(config)), renderer_(config, *path_) {}

  [[nodiscard]] const simulator::Path& path() const { return *path_; }
  [[nodiscard]] const simulator::CameraModel& camera() const { return renderer_.camera(); }
  [[nodiscard]] const std::vector<std::uint8_t>& image(int k) {
    std::vector<std::uint8_t>& image = images_[k];
    if (image.empty()) image = renderer_.render(k / kRateHz, k);
    return image;
  }

 private:
  std::unique_ptr<simulator::Path> path_;
  simulator::Renderer renderer_;
  std::map<int, std::vector<std::uint8_t>> images_;
};

class VirtualCamera {
 public:
  // The one that swings, which most cases film: they share its frames.
  VirtualCamera() : VirtualCamera(swinging_camera(), swinging_film()) {}
  explicit VirtualCamera(const simulator::Config& config)
      : VirtualCamera(config, std::make_shared<Film>(config)) {}

  VirtualCamera(const simulator::Config& config, std::shared_ptr<Film> film)
      : film_(std::move(film)) {
    const simulator::CameraConfig& c = config.camera;
    calibration_.camera = {c.focal_length, c.aspect, {c.radial_distortion}, kWidth, kHeight};
    calibration_.line_delay = c.line_delay;
  }

  [[nodiscard]] const Calibration& calibration() const { return calibration_; }
  [[nodiscard]] static double time_s(int k) { return k / kRateHz; }

  // Of frame k; lives as long as the camera.
  [[nodiscard]] ImageView image(int k) { return {film_->image(k).data(), kWidth, kHeight, kWidth}; }

  [[nodiscard]] InterpolatedPanTilt telemetry(int k, const Sigmas& sigmas = {},
                                              double before_s = 0) {
    constexpr double h = 1e-3;  // s
    const double t = time_s(k) + calibration_.line_delay * kHeight / 2 - before_s;
    const simulator::Angles before = film_->path().at(t - h);
    const simulator::Angles now = film_->path().at(t);
    const simulator::Angles after = film_->path().at(t + h);
    const auto noise = [&](double sigma) { return sigma * normal_(random_); };
    InterpolatedPanTilt out;
    out.time_s = time_s(k);  // no clock offset, as of row 0
    out.angle = {now.pan + noise(sigmas.angle), now.tilt + noise(sigmas.angle)};
    out.rate = {(after.pan - before.pan) / (2 * h) + noise(sigmas.rate),
                (after.tilt - before.tilt) / (2 * h) + noise(sigmas.rate)};
    out.covariance.diagonal() << sigmas.angle * sigmas.angle, sigmas.angle * sigmas.angle,
        sigmas.rate * sigmas.rate, sigmas.rate * sigmas.rate;
    const Vector2<double> acceleration((after.pan - 2 * now.pan + before.pan) / (h * h),
                                       (after.tilt - 2 * now.tilt + before.tilt) / (h * h));
    out.acceleration_square = acceleration.cwiseAbs2();
    out.samples = 2;
    return out;
  }

  // What telemetry that ends so long before the frame's middle row makes of it: at a constant rate, with
  // the standard deviation of the accelerations that it does not know.
  [[nodiscard]] InterpolatedPanTilt extrapolated(int k, double beyond_s) {
    InterpolatedPanTilt out = telemetry(k, {}, beyond_s);
    out.angle.pan += beyond_s * out.rate.pan;
    out.angle.tilt += beyond_s * out.rate.tilt;
    constexpr double kAcceleration =
        0.3;  // rad/s^2; the path's are 0.09 and 0.27, root mean square
    const Vector2<double> effect(kAcceleration * beyond_s * beyond_s / 2, kAcceleration * beyond_s);
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < 2; ++j) {
        const double own = i == j ? 0 : beyond_s * out.covariance(2, 2);
        out.covariance.block<2, 2>(2 * i, 2 * j).diagonal().array() += effect[i] * effect[j] + own;
      }
    }
    out.covariance.topLeftCorner<2, 2>().diagonal().array() +=
        beyond_s * beyond_s * out.covariance(2, 2);
    out.extrapolated = true;
    out.correlation_time_s = 1;
    return out;
  }

  // Where the direction that the frame gives to u truly is, less u, px.
  [[nodiscard]] Vector2<double> error(int k, const FrameOrientation& frame,
                                      const Vector2<double>& u) const {
    return pixel_error(film_->camera(), time_s(k), frame, u);
  }
  void judge(int k, const FrameOrientation& frame, double* px, double* square) const {
    judge_frame(film_->camera(), time_s(k), frame, px, square);
  }

 private:
  static const std::shared_ptr<Film>& swinging_film() {
    static const auto film = std::make_shared<Film>(swinging_camera());
    return film;
  }

  std::shared_ptr<Film> film_;
  Calibration calibration_;
  std::mt19937_64 random_{1};
  std::normal_distribution<double> normal_;
};

// One in 10^6 of chi-squares of 2 degrees is larger.
inline constexpr double kImpossible = 27.6;

inline void expect_honest(const VirtualCamera& camera, int k, const FrameOrientation& frame) {
  double px = 0;
  double square = 0;
  camera.judge(k, frame, &px, &square);
  EXPECT_LT(square, kImpossible) << "frame " << k << ", " << px << " px";
}

}  // namespace alidade::test
