#pragma once
// Frames of the virtual camera, row by row: every row sees the scene with the orientation and the
// lens of its own time, evaluated on the true path.
//
// A pixel's signal is the mean over its area and its exposure. Then, in grey levels (255 = white):
// vignetting 1 - a (r / r_corner)^2, brightness step, lens cover, noise of variance shot_noise *
// signal + read_noise^2, rounding and clipping to 8 bits. Boil moves each pixel's ray by a smooth
// random field. Sub-exposures and boil: docs/simulator.md. render() is thread-safe, and its result
// depends on its arguments only.

#include <array>
#include <cstdint>
#include <vector>

#include "test/simulator/camera_model.h"
#include "test/simulator/scene.h"
#include "test/simulator/sensor_noise.h"

namespace alidade::simulator {

class Renderer {
 public:
  // The path must outlive the renderer. Throws ConfigError as Scene does.
  Renderer(const Config& config, const Path& path);

  // The frame whose row coordinate 0 is exposed at t0_s: width x height bytes, row after row.
  // `sequence` selects the noise.
  [[nodiscard]] std::vector<std::uint8_t> render(double t0_s, std::int64_t sequence) const;

  // Whether the scene and the sensor look the same after a period of the path (but for the noise).
  [[nodiscard]] bool steady() const;

  [[nodiscard]] const CameraModel& camera() const { return camera_; }

 private:
  struct Wave {
    double along_u, along_v, along_time, phase;  // rad/px, rad/px, rad/s, rad
    Eigen::Vector2d amplitude;                   // px
  };

  [[nodiscard]] Eigen::Vector2d boil(double u, double v, double time_s) const;
  // lens: that of time_s.
  void rays_of_row(const Lens& lens, double v, double offset_u, double time_s,
                   std::vector<double>* x, std::vector<double>* y) const;
  [[nodiscard]] double light(double time_s) const;

  Config config_;
  CameraModel camera_;
  Scene scene_;
  std::vector<Wave> waves_;
  int boil_step_;  // px, between columns where boil is evaluated
  SensorNoise noise_;
};

}  // namespace alidade::simulator
