#pragma once
// `alidade calibrate-shutter`. Its options bear the names of the command line (command_line.cpp), checked there.

#include <optional>
#include <string>

namespace alidade {

struct CalibrateShutterOptions {
  std::string video;                 // a recording's directory, or a video file
  std::string config;                // in its place: of a live video
  std::optional<double> duration_s;  // of a live video, at most
  std::string pattern;               // as known_pattern.h names it
  std::string directory;  // empty: <recording>/alidade, or alidade beside the file; live: alidade
  std::string paper;      // --print: draw the pattern for it, and nothing else
  bool json = false;
};

// Returns the exit code; throws CommandError.
[[nodiscard]] int calibrate_shutter(const CalibrateShutterOptions& options);

}  // namespace alidade
