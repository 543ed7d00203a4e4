// Rates that a scene map's pictures have by telemetry: as near the truth as they say.

#include "edge_app/commands/map_recording.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "core/model/angle.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

constexpr double kNoise_rad = 1e-4;
constexpr double kPeriod_s = 4;

double pan_at(double time_s) { return 0.2 * std::sin(2 * kPi * time_s / kPeriod_s); }
double pan_rate_at(double time_s) {
  return 0.2 * 2 * kPi / kPeriod_s * std::cos(2 * kPi * time_s / kPeriod_s);
}

// A head that swings, polled at a rate, over the seam of the angle; a frame each 40 ms.
std::string recording_at(const TemporaryDirectory& directory, double rate_hz, double noise_rad) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0, noise_rad);
  std::string telemetry = "receive_time_s,pan_rad,tilt_rad\n";
  for (double t = -1; t < 21; t += 1 / rate_hz) {
    telemetry += std::to_string(t) + ',' +
                 std::to_string(wrap_angle(kPi - 0.01 + pan_at(t) + noise(random))) + ',' +
                 std::to_string(noise(random)) + '\n';
  }
  std::string frames = "frame,receive_time_s\n";
  for (int i = 0; i < 500; ++i) frames += std::to_string(i) + ',' + std::to_string(0.04 * i) + '\n';
  directory.write("telemetry.csv", telemetry);
  directory.write("frames.csv", frames);
  directory.write("frames/000000.pgm", "");
  directory.write("recording.yaml", "format: 1\nwidth: 640\nheight: 360\n");
  return directory.path();
}

// Mean square of error / sigma of pan's rate, and the largest sigma.
struct Rates {
  double mean_square = 0;
  double largest_sigma = 0;
};
Rates rates_of(const MapRecording& recording) {
  Rates out;
  int count = 0;
  for (const FrameStamp& frame : recording.frames) {
    const MapView view = map_view(recording, frame, nullptr, FocalLengthKnowledge(1000));
    if (!view.telemetry) continue;
    // With nominal axes and no tilt the camera's vertical axis is the base's.
    const double error = view.angular_velocity.y() - pan_rate_at(frame.receive_time_s);
    const double sigma = view.motion_sigma[1];
    EXPECT_GT(sigma, 0);
    out.mean_square += std::pow(error / sigma, 2);
    out.largest_sigma = std::max(out.largest_sigma, sigma);
    ++count;
  }
  EXPECT_GT(count, 400);
  out.mean_square /= count;
  return out;
}

TEST(MapRecording, ItsRatesAreAsGoodAsTheySay) {
  const TemporaryDirectory directory;
  const MapRecording recording = load_map_recording(recording_at(directory, 30, kNoise_rad), true);
  EXPECT_NEAR(recording.angle_noise, kNoise_rad, 0.2 * kNoise_rad);
  const Rates rates = rates_of(recording);
  // Some 60 independent windows: 4 sigmas are 0.7. The stamps are exact here, but not taken as such.
  EXPECT_LT(rates.mean_square, 1.7);
  EXPECT_GT(rates.mean_square, 0.2);
  // Two samples alone would give 1e-4 * sqrt(2) * 30.
  EXPECT_LT(rates.largest_sigma, 0.5 * kNoise_rad * std::sqrt(2.0) * 30);
}

TEST(MapRecording, FewSamplesGiveRatesThatSayHowLittleIsKnown) {
  const TemporaryDirectory directory;
  const MapRecording recording = load_map_recording(recording_at(directory, 4, kNoise_rad), true);
  const Rates rates = rates_of(recording);
  EXPECT_LT(rates.mean_square, 1.7);
}

}  // namespace
}  // namespace alidade
