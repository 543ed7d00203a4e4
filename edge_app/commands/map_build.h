#pragma once
// `alidade map build`: makes a scene map from recordings. The command line (command_line.cpp) names
// the options as here.

#include <string>
#include <vector>

namespace alidade {

struct MapBuildCommand {
  std::vector<std::string> recordings;  // directories
  std::string map;                      // the file to write
  std::string add;                      // a map whose keyframes are added; empty: none
  std::string calibration;   // empty: <first recording>/alidade/calibration.yaml, if it exists
  std::string focal_length;  // px, or WIDE:TELE; empty: the calibration's, or found
  int keyframes = 300;       // at most
  bool no_telemetry = false;
  bool largest_part = false;  // MapBuildOptions::largest_part
  bool json = false;
};

// options.recordings must not be empty. Returns kExitOk. Throws CommandError if an option, a
// recording, the calibration or the map to add cannot be used, the recordings differ in image size,
// another process is writing the same map, the pictures make no map, or it cannot be written.
[[nodiscard]] int build_map(const MapBuildCommand& options);

}  // namespace alidade
