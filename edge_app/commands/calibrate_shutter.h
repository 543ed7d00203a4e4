#pragma once
// `alidade calibrate-shutter`. The command line (command_line.cpp) names the options as here and
// checks them.

#include <optional>
#include <string>

namespace alidade {

struct CalibrateShutterOptions {
  std::string video;                 // a recording's directory, or a video file
  std::string config;                // in place of `video`: configuration of a live video
  std::optional<double> duration_s;  // s, at most; for a live video
  std::string pattern;               // named as in known_pattern.h
  // empty: <recording>/alidade, or alidade in the file's folder; live: alidade
  std::string directory;
  std::string paper;  // --print: only draw the pattern for this paper
  bool json = false;
};

// Returns kExitOk. Throws CommandError if an option is wrong, the video cannot be used, another
// process is writing the same lens.yaml, the calibration fails, a result cannot be written, or a
// signal ends the search in a recording or file.
[[nodiscard]] int calibrate_shutter(const CalibrateShutterOptions& options);

}  // namespace alidade
