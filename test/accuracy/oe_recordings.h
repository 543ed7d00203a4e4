#pragma once
// The recordings on which OE mode is judged: the camera of the PTCEE paper (3.4 degrees wide, 7 % of
// distortion in the corners, axes off by 12 and 14 mrad), its own and two rougher paths at up to one
// field of view a second, exposure 2 ms, noise of 2 grey levels, JPEG quality 85.
//
// Of smaller images the field of view, the time to read one out, and so the motion in fields of view,
// stay as they are. The path repeats after the recording, so that this may be seen twice in a row.
// Telemetry: 40 Hz, white noise of one pixel of 1920.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "test/simulator/config.h"

namespace alidade::test {

struct Scene {
  std::string name;
  std::filesystem::path photo;  // empty: generated
};

struct RecordingPlan {
  std::string name;
  simulator::Config config;
};

struct RecordingSize {
  int width = 1920;
  int height = 1080;
  double rate_hz = 20;
  double duration_s = 7;
};

// Of an image of 1080 rows; others are read out in as much time.
inline constexpr double kLineDelays[] = {-14.2e-6, 0.0, 25e-6};

[[nodiscard]] simulator::Config camera_on_path(const Scene& scene, simulator::PathConfig::Type path,
                                               double line_delay_1080, double fields_per_second,
                                               const RecordingSize& size, std::uint64_t seed);

// Nine: every scene of three with every path, every scene and every path with every line delay.
[[nodiscard]] std::vector<RecordingPlan> latin_square(const std::vector<Scene>& scenes,
                                                      double fields_per_second,
                                                      const RecordingSize& size);

// What goes wrong between two times of a recording.
struct Disturbance {
  std::string name;
  simulator::Config config;
  double from = 0, to = 0;         // s; nothing is disturbed outside
  double telemetry_offset_px = 0;  // added to the pan angle meanwhile
  double claimed_sigma_px = 0;     // added to the telemetry's covariance meanwhile
  bool telemetry_lost = false;
  bool honest = true;  // what is told of the telemetry's errors is so
};

[[nodiscard]] std::vector<Disturbance> disturbances(const Scene& scene, const RecordingSize& size);

}  // namespace alidade::test
