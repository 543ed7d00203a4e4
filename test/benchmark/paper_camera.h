#pragma once
// What PT mode is measured with: the calibration and the path of the PTCEE paper's camera, its telemetry
// at 30 Hz, and times and pixels to ask for, the same in each run.

#include <cmath>
#include <cstdlib>
#include <random>
#include <vector>

#include "core/realtime/pt_mode.h"

namespace alidade::benchmarks {

inline constexpr double kStampSigma = 1e-3;
inline constexpr double kAngleSigma = 1e-5;
inline constexpr int kQueries = 1024;

inline Calibration paper_calibration() {
  Calibration calibration;
  calibration.camera = {32008, 1, {55.4}, 1920, 1080};
  calibration.line_delay = -14.2e-6;
  calibration.clock_offset = -84.4e-3;
  calibration.covariance.diagonal().setConstant(1e-12);
  return calibration;
}

inline PanTilt<double> path(double t) {
  return {0.09 * std::cos(0.628 * t), 0.017 * std::sin(1.885 * t)};
}

inline std::vector<TelemetrySample> paper_telemetry(int samples) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal(0, kAngleSigma);
  std::vector<TelemetrySample> telemetry;
  for (int i = 0; i < samples; ++i) {
    const double time = i / 30.0;
    const PanTilt<double> angle = path(time);
    telemetry.push_back(
        {time, kStampSigma, angle.pan + normal(random), angle.tilt + normal(random)});
  }
  return telemetry;
}

template <std::size_t Capacity>
TelemetryBuffer<Capacity> filled_buffer() {
  TelemetryNoise noise;
  noise.pan_tilt_sigma = kAngleSigma;
  TelemetryBuffer<Capacity> buffer(noise);
  for (const TelemetrySample& sample : paper_telemetry(static_cast<int>(Capacity) + 20)) {
    if (buffer.push(sample) != PushStatus::kStored) std::abort();
  }
  return buffer;
}

// Image times whose telemetry is the latest or anything in the buffer.
inline std::vector<double> frame_times(double newest, double oldest_age) {
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> age(0, oldest_age);
  std::vector<double> times(kQueries);
  for (double& time : times) time = newest + 0.0844 - age(random);
  return times;
}

inline std::vector<Vector2<double>> pixels() {
  std::mt19937_64 random(3);
  std::uniform_real_distribution<double> u(0, 1920);
  std::uniform_real_distribution<double> v(0, 1080);
  std::vector<Vector2<double>> result(kQueries);
  for (auto& pixel : result) pixel = {u(random), v(random)};
  return result;
}

inline FrameOrientation paper_frame() {
  const auto buffer = filled_buffer<256>();
  FrameOrientation frame;
  if (!has_result(pt_orientation(paper_calibration(), buffer, *buffer.newest_time(), kStampSigma,
                                 &frame))) {
    std::abort();
  }
  return frame;
}

}  // namespace alidade::benchmarks
