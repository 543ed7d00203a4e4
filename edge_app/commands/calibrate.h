#pragma once
// `alidade calibrate`. The command line (command_line.cpp) names the options as here and checks
// them.

#include <optional>
#include <string>
#include <vector>

namespace alidade {

struct CalibrateOptions {
  std::vector<std::string> recordings;  // directories
  std::string directory;                // empty: <recording>/alidade
  // Device units; readings that differ by no more are one zoom. Empty: found from their jitter.
  std::optional<double> zoom_tolerance;
  bool json = false;
  int passes = 2;     // how often tracks are sought in the video: 1 or 2
  std::string prior;  // a lens.yaml; empty: none
  // Priors: VALUE, or VALUE,SIGMA, or "free"; empty: the estimator's default. px, 1, 1, s/row, s.
  std::string focal_length;
  std::string aspect;
  std::string radial_distortion;
  std::string line_delay;
  std::string clock_offset;
  std::optional<double> scale_sigma;         // of pan_scale and tilt_scale; empty: their default
  std::optional<double> centre_sigma_px;     // empty: kUsualCentreShare of the width
  std::optional<double> angle_accuracy_deg;  // CalibrationOptions::angle_accuracy_rad; empty: 0
  std::vector<double> pupil_m;               // Pupil::place_m; empty: the usual one
  std::vector<double> scene_distance_m;      // nearest and farthest; empty: nothing is known
};

// Calibrates from one recording, or from all of them together if they differ in zoom.
// options.recordings must not be empty. Returns kExitOk. Throws CommandError if an option or a
// recording cannot be used, another process is writing the same calibration, the calibration fails,
// a result cannot be written, or SIGINT or SIGTERM comes.
[[nodiscard]] int calibrate_recordings(const CalibrateOptions& options);

}  // namespace alidade
