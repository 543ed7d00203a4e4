#pragma once
// TurningCamera: images of a camera that turns over a far scene for ever, and where it pointed.
//
// The scene is the two photos of test/data and their mirror images, a plane tangent to the sphere straight
// ahead, scaled so that an image of any size shows the same: the field of view is 20 degrees. Pan and tilt
// run through a closed figure in `frames` frames at 30 Hz, up to 20 pixels (of 1080 lines) a frame. Rows are
// exposed one after the other, 15 ms from first to last. Noise has sigma 2 grey levels.
// Truth is evaluated at each row's own time. Images are made by the constructor; OpenCV's
// remap places pixels to 1/64 px.

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "core/model/calibration.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"

namespace alidade::benchmarks {

class TurningCamera {
 public:
  TurningCamera(int height, int frames);  // px; width is 16/9 of it

  [[nodiscard]] const Calibration& calibration() const { return calibration_; }
  [[nodiscard]] int frames() const { return static_cast<int>(images_.size()); }

  // Of frame k, counted on and on: image k % frames().
  [[nodiscard]] const cv::Mat& image(int k) const;
  [[nodiscard]] ImageView view(int k) const;
  [[nodiscard]] double time_s(int k) const;  // row 0
  [[nodiscard]] double middle_row_time_s(int k) const;

  // True motion at a time.
  [[nodiscard]] PanTilt<double> angle(double time_s) const;
  [[nodiscard]] PanTilt<double> rate(double time_s) const;
  [[nodiscard]] Matrix3<double> R_base_from_camera(double time_s) const;
  // True direction of a pixel, at its own row's time.
  [[nodiscard]] Vector3<double> direction(int k, const Vector2<double>& u) const;

  // At the middle row, with noise that differs from call to call.
  [[nodiscard]] InterpolatedPanTilt telemetry(int k);

 private:
  [[nodiscard]] cv::Mat expose(const cv::Mat& scene, int k) const;

  Calibration calibration_;
  double period_s_;
  cv::RNG random_;
  std::vector<cv::Mat> images_;
};

// As cameras send it: with colours, though grey ones, of quality 85.
[[nodiscard]] std::vector<std::uint8_t> jpeg_of(const cv::Mat& image);

}  // namespace alidade::benchmarks
