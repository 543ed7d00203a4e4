#pragma once
// `alidade calibrate`. Its options bear the names of the command line (command_line.cpp), checked there.

#include <optional>
#include <string>
#include <vector>

namespace alidade {

struct CalibrateOptions {
  std::vector<std::string> recordings;  // their directories
  std::string directory;                // empty: <recording>/alidade
  // Device units within which two zoom readings are one; none: as their jitter shows.
  std::optional<double> zoom_tolerance;
  bool json = false;
  int passes = 2;     // of finding tracks in the video
  std::string prior;  // a lens.yaml; empty: none
  // VALUE or VALUE,SIGMA; "free"; empty: as the estimator has it.
  std::string focal_length;
  std::string aspect;
  std::string radial_distortion;
  std::string line_delay;
  std::string clock_offset;
  std::optional<double> scale_sigma;
};

// The calibration from a recording, or, of several zoom readings, from all of them. Returns the exit code; throws
// CommandError.
[[nodiscard]] int calibrate_recordings(const CalibrateOptions& options);

}  // namespace alidade
