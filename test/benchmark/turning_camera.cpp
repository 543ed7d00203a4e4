#include "test/benchmark/turning_camera.h"

#include <cmath>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

namespace alidade::benchmarks {
namespace {

constexpr double kFrameRate = 30;          // Hz
constexpr double kReadOut = 15e-3;         // s
constexpr double kFieldOfView = kPi / 9;   // rad, width
constexpr double kPanAmplitude = 0.0234;   // rad: 20 px of 1080 lines a frame, for 40 frames
constexpr double kTiltAmplitude = 0.0080;  // rad
constexpr double kNoise = 2;               // grey levels
constexpr double kAngleSigma = 1e-4;       // rad: half a pixel of 1080 lines
constexpr double kRateSigma = 1e-3;        // rad/s

cv::Mat photo(const char* name) {
  cv::Mat image = cv::imread(std::string(ALIDADE_TEST_DATA) + "/" + name, cv::IMREAD_GRAYSCALE);
  if (image.empty()) std::abort();
  return image;
}

cv::Mat mirrored(const cv::Mat& image) {
  cv::Mat mirror;
  cv::flip(image, mirror, 1);
  return mirror;
}

// 3264 x 2174 pixels for 2160 lines, where a frame shows two thirds of it.
cv::Mat scene_for(int height) {
  const cv::Mat above = photo("aitzgorri_by_Aitzol_Berasategi.jpg");
  const cv::Mat below = photo("picosdeeuropa_by_Aitzol_Berasategi.jpg").rowRange(0, above.rows);
  cv::Mat rows[2];
  cv::hconcat(above, mirrored(above), rows[0]);
  cv::hconcat(mirrored(below), below, rows[1]);
  cv::Mat mosaic;
  cv::vconcat(rows, 2, mosaic);
  const double scale = 1.5 * height / 2160;
  cv::Mat scene;
  cv::resize(mosaic, scene, {}, scale, scale, scale < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
  return scene;
}

}  // namespace

TurningCamera::TurningCamera(int height, int frames) : period_s_(frames / kFrameRate), random_(1) {
  Camera<double>& camera = calibration_.camera;
  camera.height = height;
  camera.width = height * 16 / 9;
  camera.focal_length = camera.width / (2 * std::tan(kFieldOfView / 2));
  calibration_.line_delay = kReadOut / height;
  const cv::Mat scene = scene_for(height);
  cv::Mat noise(height, camera.width, CV_16S);
  for (int k = 0; k < frames; ++k) {
    cv::Mat image;
    expose(scene, k).convertTo(image, CV_16S);
    random_.fill(noise, cv::RNG::NORMAL, 0, kNoise);
    image += noise;
    images_.emplace_back();
    image.convertTo(images_.back(), CV_8U);
  }
}

cv::Mat TurningCamera::expose(const cv::Mat& scene, int k) const {
  const Camera<double>& camera = calibration_.camera;
  cv::Mat map(camera.height, camera.width, CV_32FC2);
  for (int v = 0; v < camera.height; ++v) {
    const double time = time_s(k) + (v + 0.5) * calibration_.line_delay;
    const Matrix3<double> R = R_base_from_camera(time);
    const Vector3<double> first =
        R * Vector3<double>(0.5 - 0.5 * camera.width, v + 0.5 - 0.5 * camera.height,
                            camera.focal_length);
    const Vector3<double> step = R.col(0);
    auto* to = map.ptr<cv::Point2f>(v);
    for (int u = 0; u < camera.width; ++u) {
      const Vector3<double> d = first + u * step;
      const double scale = camera.focal_length / d.x();
      // OpenCV has the centre of the first pixel at (0, 0).
      to[u].x = static_cast<float>(0.5 * scene.cols + scale * d.y() - 0.5);
      to[u].y = static_cast<float>(0.5 * scene.rows + scale * d.z() - 0.5);
    }
  }
  cv::Mat image;
  cv::remap(scene, image, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REFLECT);
  return image;
}

const cv::Mat& TurningCamera::image(int k) const {
  return images_[static_cast<std::size_t>(k) % images_.size()];
}

ImageView TurningCamera::view(int k) const {
  const cv::Mat& p = image(k);
  return {p.data, p.cols, p.rows, static_cast<std::ptrdiff_t>(p.step)};
}

double TurningCamera::time_s(int k) const { return k / kFrameRate; }

double TurningCamera::middle_row_time_s(int k) const { return time_s(k) + 0.5 * kReadOut; }

PanTilt<double> TurningCamera::angle(double time_s) const {
  const double phase = 2 * kPi * time_s / period_s_;
  return {kPanAmplitude * std::cos(phase), kTiltAmplitude * std::sin(2 * phase)};
}

PanTilt<double> TurningCamera::rate(double time_s) const {
  const double phase_rate = 2 * kPi / period_s_;
  const double phase = phase_rate * time_s;
  return {-kPanAmplitude * phase_rate * std::sin(phase),
          2 * kTiltAmplitude * phase_rate * std::cos(2 * phase)};
}

Matrix3<double> TurningCamera::R_base_from_camera(double time_s) const {
  return alidade::R_base_from_camera(calibration_.mechanics, angle(time_s));
}

Vector3<double> TurningCamera::direction(int k, const Vector2<double>& u) const {
  const Camera<double>& camera = calibration_.camera;
  const Vector3<double> d_c(u.x() - 0.5 * camera.width, u.y() - 0.5 * camera.height,
                            camera.focal_length);
  return R_base_from_camera(time_s(k) + u.y() * calibration_.line_delay) * d_c.normalized();
}

InterpolatedPanTilt TurningCamera::telemetry(int k) {
  const double time = middle_row_time_s(k);
  InterpolatedPanTilt at;
  at.angle = angle(time);
  at.angle.pan += random_.gaussian(kAngleSigma);
  at.angle.tilt += random_.gaussian(kAngleSigma);
  at.rate = rate(time);
  at.rate.pan += random_.gaussian(kRateSigma);
  at.rate.tilt += random_.gaussian(kRateSigma);
  at.covariance.diagonal() << kAngleSigma * kAngleSigma, kAngleSigma * kAngleSigma,
      kRateSigma * kRateSigma, kRateSigma * kRateSigma;
  // Of the figure, on average over a round.
  const double phase_rate = 2 * kPi / period_s_;
  const double pan = kPanAmplitude * phase_rate * phase_rate;
  const double tilt = 4 * kTiltAmplitude * phase_rate * phase_rate;
  at.acceleration_square = {pan * pan / 2, tilt * tilt / 2};
  at.samples = 8;
  return at;
}

std::vector<std::uint8_t> jpeg_of(const cv::Mat& image) {
  constexpr int kQuality = 85;
  const std::vector<cv::Mat> channels(3, image);
  cv::Mat colour;
  cv::merge(channels, colour);
  std::vector<std::uint8_t> jpeg;
  cv::imencode(".jpg", colour, jpeg, {cv::IMWRITE_JPEG_QUALITY, kQuality});
  return jpeg;
}

}  // namespace alidade::benchmarks
