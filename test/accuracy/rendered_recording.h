#pragma once
// RenderedRecording: frames of the virtual camera with their truth, for judging what looks at pixels.
//
// A frame is rendered once without noise, rounded to 8 bits and, if a folder for it is given, kept
// there; its noise (white, sensor.read_noise) and its JPEG coding (sensor.jpeg_quality, 0 for none) are
// added whenever it is asked for, so that both kinds share one rendering. Rounding twice adds 1/12 of a
// squared grey level. Frame i begins (row coordinate 0) at i / rate; stamps are exact, angles are noisy.
// Truth comes from test/simulator alone; what is told to core/ is the configuration, word by word.
// Kept frames are named after all of the configuration that they show: a change of it makes new ones, a
// change of the renderer does not. image() may be called by several threads.

#include <Eigen/Core>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/model/calibration.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/telemetry/telemetry_buffer.h"
#include "test/accuracy/kept_frames.h"
#include "test/simulator/renderer.h"

namespace alidade::test {

[[nodiscard]] ImageView view_of(const cv::Mat& image);

// Makes the path's largest speed this many horizontal fields of view a second, by its amplitude.
void set_peak_speed(double fields_per_second, simulator::Config* config);

enum class FrameNoise { kNone, kSensorAndJpeg };

class RenderedRecording {
 public:
  // config.duration says how long. An empty folder keeps nothing. Throws ConfigError.
  RenderedRecording(std::string name, const simulator::Config& config,
                    const std::filesystem::path& cache = {});
  RenderedRecording(const RenderedRecording&) = delete;
  RenderedRecording& operator=(const RenderedRecording&) = delete;

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const simulator::Config& config() const { return config_; }
  [[nodiscard]] int size() const { return frames_; }
  [[nodiscard]] double time(int frame) const { return frame / config_.image.rate_hz; }

  // Throws std::runtime_error if a kept frame can be neither read nor written.
  [[nodiscard]] cv::Mat image(int frame, FrameNoise noise) const;
  // All of them, made by all processors.
  [[nodiscard]] std::vector<cv::Mat> images(FrameNoise noise) const;

  // Truth.
  [[nodiscard]] simulator::Angles angles(double time_s) const { return path_->at(time_s); }
  [[nodiscard]] Eigen::Matrix3d base_from_camera(double time_s) const {
    return camera_.base_from_camera_at(time_s);
  }
  // Unit, in the camera frame, with a zoom at time 0; NaN where a pixel sees nothing.
  [[nodiscard]] Eigen::Vector3d ray(const Eigen::Vector2d& u) const {
    return camera_.slope(u.x(), u.y()).homogeneous().normalized();
  }
  // Of a pixel of a frame, at its own row's time; unit, in the base frame.
  [[nodiscard]] Eigen::Vector3d direction(int frame, const Eigen::Vector2d& u) const {
    const double row_time = time(frame) + u.y() * config_.camera.line_delay;
    return base_from_camera(row_time) *
           camera_.slope_at(u.x(), u.y(), row_time).homogeneous().normalized();
  }
  [[nodiscard]] const simulator::CameraModel& camera() const { return camera_; }
  [[nodiscard]] simulator::Lens lens(double time_s) const { return camera_.lens_at(time_s); }

  // The truth, as an estimator is told it: without any uncertainty.
  [[nodiscard]] Calibration calibration() const;
  // What the telemetry said about the time at which this frame's middle row was exposed, were that
  // calibration right.
  [[nodiscard]] QueryStatus telemetry(const Calibration& calibration, int frame,
                                      InterpolatedPanTilt* out) const;

 private:
  [[nodiscard]] cv::Mat rendered(int frame) const;

  std::string name_;
  simulator::Config config_;
  int frames_;
  std::unique_ptr<simulator::Path> path_;
  simulator::CameraModel camera_;
  std::unique_ptr<simulator::Renderer> renderer_;
  TelemetryBuffer<4096> telemetry_;
  KeptFrames kept_;
};

}  // namespace alidade::test
