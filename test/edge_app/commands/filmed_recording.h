#pragma once
// A recording with pictures that the virtual camera rendered, made once in a process, for the tests
// of all commands that look at pictures.

#include "test/simulator/config.h"
#include "test/simulator/recording_writer.h"
#include "test/support/temporary_directory.h"

namespace alidade {

inline constexpr int kFilmedFrames = 100;
inline constexpr double kFilmedFocalLength = 8002;  // px

// The paper's camera at a quarter of its size; telemetry errs by 1.6 px.
inline constexpr const char* kFilmedCamera =
    "seed: 5\n"
    "duration_s: 8\n"
    "image: {width: 480, height: 270, rate_hz: 12.5}\n"
    "camera: {focal_length_px: 8002, radial_distortion: 55.4, line_delay_us: -56.8, "
    "pan_axis_mrad: [-12, 0], tilt_axis_mrad: [0, 14], clock_offset_ms: -84.4}\n"
    "path: {type: triple_cosine, amplitude: 0.5, period_s: 8}\n"
    "scene: {procedural: [{azimuth_deg: 0, elevation_deg: 0, width_deg: 16, height_deg: 8}]}\n"
    "sensor: {exposure_ms: 1, shot_noise: 0.02, read_noise: 0.7, jpeg_quality: 90}\n"
    "telemetry: {rate_hz: 50, sigma_rad: 2.0e-4}\n"
    "recording: {images: video}\n";

// Its folder has recording/, with truth.yaml and truth.csv. Not to be changed.
inline const TemporaryDirectory& filmed_recording() {
  static const TemporaryDirectory folder;
  static const bool is_made = [] {
    const std::string camera = folder.write("camera.yaml", kFilmedCamera);
    simulator::write_recording(simulator::load_config(camera), folder.path() + "/recording");
    return true;
  }();
  static_cast<void>(is_made);
  return folder;
}

}  // namespace alidade
