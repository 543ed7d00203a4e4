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
  std::string directory;  // empty: <recording>/alidade, or alidade beside the file; live: alidade
  std::string paper;      // --print: only draw the pattern for this paper
  bool json = false;
};

// Returns the exit code; throws CommandError.
[[nodiscard]] int calibrate_shutter(const CalibrateShutterOptions& options);

}  // namespace alidade
