#pragma once
// `alidade calibrate-shutter`. Its options bear the names of the command line (command_line.cpp), checked there.

#include <string>

namespace alidade {

struct CalibrateShutterOptions {
  std::string video;      // a recording's directory, or a video file
  std::string pattern;    // as known_pattern.h names it
  std::string directory;  // empty: <recording>/alidade, or alidade beside the file
  std::string paper;      // --print: draw the pattern for it, and nothing else
  bool json = false;
};

// Returns the exit code; throws CommandError.
[[nodiscard]] int calibrate_shutter(const CalibrateShutterOptions& options);

}  // namespace alidade
