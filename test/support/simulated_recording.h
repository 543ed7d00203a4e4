#pragma once
// What a turning camera would have seen: recordings with known truth, made without the model's
// code. Landmarks on a grid of azimuth and elevation (multiples of field of view / 10), the
// published path or any other one,
//   pan = 9 s sin(2 pi t / 10) / (2 pi), tilt = -3 s cos(6 pi t / 10) / (2 pi)   s: field of view
// white noise on pixels, angles and stamps, one draw of each measured period. Each landmark is
// projected at the row that sees it. Fixed seed, same recording. Disturbances draw from their own
// generator, so that all else stays the same with and without them. Angles are rad.

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "core/calibration/calibrate.h"

namespace alidade::test {

struct Simulation {
  std::uint64_t seed = 1;
  double focal_length = 4000;  // px
  double aspect = 1;
  double radial_distortion = 0;
  double line_delay = 1e-6;  // s/row
  Eigen::Vector3d pan_axis = Eigen::Vector3d(0.02, -0.01, 1).normalized();
  Eigen::Vector3d tilt_axis = Eigen::Vector3d(-0.03, 1, 0.02).normalized();
  double pan_scale = 1;
  double tilt_scale = 1;
  double clock_offset = 0.02;  // s
  int width = 1920;
  int height = 1080;
  double duration_s = 10;
  double image_rate_hz = 15;
  double telemetry_rate_hz = 60;
  double pixel_sigma = 0.3;
  double pan_tilt_sigma = 5e-5;
  double image_stamp_sigma_s = 1e-3;
  double telemetry_stamp_sigma_s = 1e-3;
  double image_period_sigma_s = 3e-5;
  double telemetry_period_sigma_s = 3e-5;
  double landmarks_per_field = 10;              // across the width
  std::function<Eigen::Vector2d(double)> path;  // true pan, tilt (rad); the published one if empty

  // Disturbances.
  double lost_frames = 0;         // share
  double image_outliers = 0;      // share, anywhere in the image
  double telemetry_outliers = 0;  // share
  double telemetry_outlier_rad = 0.02;
  double angle_quantum_rad = 0;
  bool one_sided_stamps = false;  // exponential instead of normal, same sigma
  double sender_skew = 0;         // the image clock's relative error: periods, not the motion
  bool with_noise = true;         // tell the estimator the noise
  bool with_sequence = true;
  double pan_offset_rad = 0;  // of the whole path; angles are wrapped
  // Telemetry reads amplitude sin(2 pi angle / period + phase) more, for each axis.
  Eigen::Vector2d gear_amplitude_rad = Eigen::Vector2d::Zero();
  Eigen::Vector2d gear_period_rad = Eigen::Vector2d::Ones();
  Eigen::Vector2d gear_phase_rad = Eigen::Vector2d::Zero();
  // Backlash between motor and camera. The encoder is on the motor, whose path is the one given,
  // or behind the gear: then the camera's is given, and the reading is dragged.
  Eigen::Vector2d play_rad = Eigen::Vector2d::Zero();
  bool encoder_on_motor = true;
  Eigen::Vector2d optical_centre_offset_px = Eigen::Vector2d::Zero();

  [[nodiscard]] double field_of_view() const { return 2 * std::atan(width / (2 * focal_length)); }
  [[nodiscard]] Eigen::Vector2d angles(double t) const {
    if (path) return path(t) + Eigen::Vector2d(pan_offset_rad, 0);
    const double s = field_of_view();
    return {9 * s * std::sin(2 * kPi * t / 10) / (2 * kPi) + pan_offset_rad,
            -3 * s * std::cos(6 * kPi * t / 10) / (2 * kPi)};
  }
};

// Fast enough for a session of some seconds, its stamps of arrival: never early.
inline Simulation arrival_stamped_camera() {
  Simulation s;
  s.seed = 3;
  s.image_rate_hz = 20;
  s.pixel_sigma = 0.1;
  s.image_stamp_sigma_s = 5e-4;
  s.telemetry_stamp_sigma_s = 5e-4;
  s.one_sided_stamps = true;
  return s;
}

// What calibrate() gets, and the truth behind it.
struct SimulatedRecording {
  CalibrationInput input;
  std::vector<double> frame_time_s;        // of input.frames, row 0
  std::vector<double> telemetry_time_s;    // of input.telemetry
  std::vector<Eigen::Vector3d> landmarks;  // the index is the landmark's name
  std::vector<Eigen::Vector2i> grid;       // azimuth, elevation in steps of the grid
  std::vector<bool> observation_is_outlier;
  std::vector<bool> telemetry_is_outlier;
};

// The base experiment's distribution of everything.
inline Simulation draw_base_simulation(std::uint64_t seed) {
  std::mt19937_64 random(seed * 7919 + 13);
  const auto uniform = [&](double a, double b) {
    return std::uniform_real_distribution<double>(a, b)(random);
  };
  const auto log_uniform = [&](double a, double b) {
    return std::exp(uniform(std::log(a), std::log(b)));
  };
  Simulation s;
  s.seed = seed;
  s.image_rate_hz = uniform(10, 30);
  s.telemetry_rate_hz = uniform(3 * s.image_rate_hz, 100);
  s.pan_tilt_sigma = log_uniform(1e-5, 1e-4);
  s.pixel_sigma = log_uniform(0.2, 0.5);
  s.image_stamp_sigma_s = log_uniform(1e-4, 5e-3);
  s.telemetry_stamp_sigma_s = log_uniform(1e-4, 5e-3);
  s.image_period_sigma_s = log_uniform(1e-5, std::min(1e-4, s.image_stamp_sigma_s));
  s.telemetry_period_sigma_s = log_uniform(1e-5, std::min(1e-4, s.telemetry_stamp_sigma_s));
  s.focal_length = uniform(960 / std::tan(kPi / 6), 960 / std::tan(kPi / 360));
  s.radial_distortion = uniform(-0.3, 0.3);
  s.clock_offset = uniform(-0.1, 0.1);
  const auto axis = [&](Eigen::Vector3d d) {
    for (int i = 0; i < 3; ++i) {
      if (d[i] == 0) d[i] = uniform(-0.05, 0.05);
    }
    return d.normalized();
  };
  s.pan_axis = axis({0, 0, 1});
  s.tilt_axis = axis({0, 1, 0});
  s.line_delay = uniform(0, 2e-3 / 1080);
  return s;
}

namespace internal {

// What a path drags along at half the play's width: the angles of each millisecond.
class DraggedPath {
 public:
  DraggedPath(const Simulation& s)
      : path_([s](double t) { return s.angles(t); }), half_(0.5 * s.play_rad) {
    Eigen::Vector2d at = path_(kBegin_s);
    for (double t = kBegin_s; t < s.duration_s - kBegin_s; t += kStep_s) {
      at = dragged(at, t);
      states_.push_back(at);
    }
  }
  [[nodiscard]] Eigen::Vector2d operator()(double t) const {
    const double steps = std::max(0.0, (t - kBegin_s) / kStep_s);
    return dragged(states_[std::min(static_cast<std::size_t>(steps), states_.size() - 1)], t);
  }

 private:
  static constexpr double kBegin_s = -3;
  static constexpr double kStep_s = 1e-3;

  [[nodiscard]] Eigen::Vector2d dragged(const Eigen::Vector2d& at, double t) const {
    const Eigen::Vector2d driver = path_(t);
    return at.cwiseMax(driver - half_).cwiseMin(driver + half_);
  }

  std::function<Eigen::Vector2d(double)> path_;
  Eigen::Vector2d half_;
  std::vector<Eigen::Vector2d> states_;
};

inline Eigen::Matrix3d camera_to_base(const Simulation& s, const Eigen::Vector2d& angle) {
  // Columns: where the camera's right, down and forward point in forward, right, down.
  Eigen::Matrix3d right_down_forward;
  right_down_forward.col(0) = Eigen::Vector3d::UnitY();
  right_down_forward.col(1) = Eigen::Vector3d::UnitZ();
  right_down_forward.col(2) = Eigen::Vector3d::UnitX();
  return (Eigen::AngleAxisd(angle[0], s.pan_axis) * Eigen::AngleAxisd(angle[1], s.tilt_axis))
             .toRotationMatrix() *
         right_down_forward;
}

// False behind the camera.
inline bool pixel_at(const Simulation& s, const Eigen::Vector2d& angle, const Eigen::Vector3d& d,
                     double* u, double* v) {
  const Eigen::Vector3d c = camera_to_base(s, angle).transpose() * d;
  if (c[2] <= 0.1) return false;
  const double x = c[0] / c[2];
  const double y = c[1] / c[2];
  const double stretch = 1 + s.radial_distortion * (x * x + y * y);
  *u = s.focal_length * x * stretch + s.width / 2.0 + s.optical_centre_offset_px[0];
  *v = s.focal_length * s.aspect * y * stretch + s.height / 2.0 + s.optical_centre_offset_px[1];
  return true;
}

// The column and the row in which a landmark is seen: the row whose exposure meets it. That is
// where landmark's row - exposed row changes its sign. Both are nearly straight, so regula falsi
// finds it (Illinois: Dowell, Jarratt 1971).
inline bool rolling_pixel(const Simulation& s, double frame_time, const Eigen::Vector3d& d,
                          double* u, double* v) {
  constexpr double kAccuracy_px = 1e-11;
  const auto ahead = [&](double row) {
    return pixel_at(s, s.angles(frame_time + row * s.line_delay), d, u, v)
               ? *v - row
               : -std::numeric_limits<double>::infinity();
  };
  double low = -0.2 * s.height;
  double high = 1.2 * s.height;
  double at_low = ahead(low);
  double at_high = ahead(high);
  if (!(at_low > 0) || at_high > 0) return false;
  double row = low;
  int side = 0;
  for (int i = 0; i < 100; ++i) {
    row = std::isfinite(at_high) ? (low * at_high - high * at_low) / (at_high - at_low)
                                 : 0.5 * (low + high);
    const double at_row = ahead(row);
    if (std::abs(at_row) < kAccuracy_px) break;
    if (at_row > 0) {
      low = row;
      at_low = at_row;
      if (side > 0) at_high /= 2;
      side = 1;
    } else {
      high = row;
      at_high = at_row;
      if (side < 0) at_low /= 2;
      side = -1;
    }
  }
  return std::isfinite(ahead(row)) && *u >= 0 && *u <= s.width && *v >= 0 && *v <= s.height;
}

}  // namespace internal

inline SimulatedRecording simulate_with_truth(const Simulation& given) {
  Simulation s = given;
  std::function<Eigen::Vector2d(double)> encoder = [given](double t) { return given.angles(t); };
  if (!given.play_rad.isZero()) {
    const internal::DraggedPath dragged(given);
    if (given.encoder_on_motor) {
      s.path = dragged;
      s.pan_offset_rad = 0;  // is in the path
    } else {
      encoder = dragged;
    }
  }
  std::mt19937_64 random(s.seed);
  std::mt19937_64 disturbance(s.seed + 0x9e3779b97f4a7c15u);
  std::normal_distribution<double> normal;
  std::exponential_distribution<double> exponential;
  std::uniform_real_distribution<double> uniform(0, 1);
  const auto stamp_noise = [&](double sigma) {
    return sigma * (s.one_sided_stamps ? exponential(random) : normal(random));
  };
  SimulatedRecording out;
  CalibrationInput& input = out.input;
  input.width = s.width;
  input.height = s.height;
  const double image_period = 1 / s.image_rate_hz;
  const double telemetry_period = 1 / s.telemetry_rate_hz;
  const double image_period_error = s.image_period_sigma_s * normal(random);
  const double telemetry_period_error = s.telemetry_period_sigma_s * normal(random);
  if (s.with_noise) {
    input.noise.image_stamp_sigma_s = s.image_stamp_sigma_s;
    input.noise.image_period_s = image_period * (1 + s.sender_skew) + image_period_error;
    input.noise.image_period_sigma_s = s.image_period_sigma_s;
    input.noise.telemetry_stamp_sigma_s = s.telemetry_stamp_sigma_s;
    input.noise.telemetry_period_s = telemetry_period + telemetry_period_error;
    input.noise.telemetry_period_sigma_s = s.telemetry_period_sigma_s;
    input.noise.pan_tilt_sigma_rad = s.pan_tilt_sigma;
  }

  // The grid covers what the path can show.
  const double spacing = s.field_of_view() / s.landmarks_per_field;
  Eigen::Vector2d low = s.angles(0);
  Eigen::Vector2d high = low;
  for (double t = 0; t < s.duration_s; t += 0.01) {
    low = low.cwiseMin(s.angles(t));
    high = high.cwiseMax(s.angles(t));
  }
  const double reach = 0.75 * s.field_of_view() + 0.15;
  const auto step = [&](double angle) { return static_cast<int>(std::ceil(angle / spacing)); };
  for (int i = step(low[0] - reach); i < step(high[0] + reach); ++i) {
    for (int j = step(std::max(-1.5, low[1] - reach)); j < step(std::min(1.5, high[1] + reach));
         ++j) {
      const double azimuth = i * spacing;
      const double elevation = j * spacing;
      out.grid.emplace_back(i, j);
      out.landmarks.emplace_back(std::cos(elevation) * std::cos(azimuth),
                                 std::cos(elevation) * std::sin(azimuth), -std::sin(elevation));
    }
  }

  const double image_phase = uniform(random) * image_period;
  for (int n = 0; image_phase + n * image_period < s.duration_s; ++n) {
    const double time = image_phase + n * image_period;
    const bool lost = uniform(disturbance) < s.lost_frames;
    CalibrationFrame frame;
    frame.frame = n;
    frame.stamp_s = time * (1 + s.sender_skew) + stamp_noise(s.image_stamp_sigma_s);
    if (s.with_sequence) frame.sequence = n;
    if (!lost) {
      input.frames.push_back(frame);
      out.frame_time_s.push_back(time);
    }
    const Eigen::Vector3d forward = internal::camera_to_base(s, s.angles(time)).col(2);
    const double near = std::cos(0.8 * s.field_of_view() + 0.01);
    for (std::size_t l = 0; l < out.landmarks.size(); ++l) {
      double u = 0;
      double v = 0;
      if (forward.dot(out.landmarks[l]) < near) continue;
      if (!internal::rolling_pixel(s, time, out.landmarks[l], &u, &v)) continue;
      u += s.pixel_sigma * normal(random);
      v += s.pixel_sigma * normal(random);
      if (lost) continue;
      const bool outlier = uniform(disturbance) < s.image_outliers;
      if (outlier) {
        u = s.width * uniform(disturbance);
        v = s.height * uniform(disturbance);
      }
      input.observations.push_back({n, static_cast<std::int64_t>(l), u, v, s.pixel_sigma});
      out.observation_is_outlier.push_back(outlier);
    }
  }

  const double telemetry_phase = uniform(random) * telemetry_period;
  for (int m = 0; telemetry_phase + m * telemetry_period < s.duration_s + 2; ++m) {
    const double time = telemetry_phase + m * telemetry_period - 1;
    const Eigen::Vector2d angle = encoder(time);
    CalibrationTelemetry sample;
    sample.stamp_s = time + s.clock_offset + stamp_noise(s.telemetry_stamp_sigma_s);
    if (s.with_sequence) sample.sequence = m;
    bool outlier = false;
    const auto measure = [&](int axis, double scale) {
      const double gear =
          s.gear_amplitude_rad[axis] *
          std::sin(2 * kPi * angle[axis] / s.gear_period_rad[axis] + s.gear_phase_rad[axis]);
      double measured = scale * angle[axis] + gear + s.pan_tilt_sigma * normal(random);
      if (uniform(disturbance) < s.telemetry_outliers) {
        measured += s.telemetry_outlier_rad * std::normal_distribution<double>()(disturbance);
        outlier = true;
      }
      if (s.angle_quantum_rad > 0) {
        measured = std::round(measured / s.angle_quantum_rad) * s.angle_quantum_rad;
      }
      return std::remainder(measured, 2 * kPi);
    };
    sample.pan_rad = measure(0, s.pan_scale);
    sample.tilt_rad = measure(1, s.tilt_scale);
    input.telemetry.push_back(sample);
    out.telemetry_time_s.push_back(time);
    out.telemetry_is_outlier.push_back(outlier);
  }
  return out;
}

inline CalibrationInput simulate(const Simulation& s) { return simulate_with_truth(s).input; }

// The clock offset at the recording's middle, which is the one that is estimated.
inline double true_clock_offset(const Simulation& s) {
  return s.clock_offset - s.sender_skew * s.duration_s / 2;
}

// (estimate - truth), in the order of Parameter; an axis's in the tangent basis of its estimate.
inline Eigen::Matrix<double, kParameterCount, 1> calibration_error(const Simulation& s,
                                                                   const Calibration& c) {
  Eigen::Matrix<double, kParameterCount, 1> error;
  const auto axis_error = [](const Eigen::Vector3d& estimate, const Eigen::Vector3d& truth) {
    return Eigen::Vector2d(-direction_minus<double>(truth, estimate));
  };
  error << c.camera.focal_length - s.focal_length, c.camera.aspect - s.aspect,
      c.camera.distortion.radial - s.radial_distortion,
      c.camera.centre_u - s.optical_centre_offset_px[0],
      c.camera.centre_v - s.optical_centre_offset_px[1], c.line_delay - s.line_delay,
      axis_error(c.mechanics.pan_axis, s.pan_axis), axis_error(c.mechanics.tilt_axis, s.tilt_axis),
      c.mechanics.pan_scale - s.pan_scale, c.mechanics.tilt_scale - s.tilt_scale,
      c.clock_offset - true_clock_offset(s);
  return error;
}

}  // namespace alidade::test
