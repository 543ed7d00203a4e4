#pragma once
// `alidade localize`: where pictures look, by a scene map, one line of JSON each. Its options bear the names of the command line
// (command_line.cpp).

#include <string>
#include <vector>

namespace alidade {

struct LocalizeCommand {
  std::string map;
  std::vector<std::string> pictures;  // files, and directories of recordings
  std::string
      calibration;  // tells f by the zoom reading, clocks, axes; empty: telemetry gives the orientation alone
  bool no_telemetry = false;
  int every = 1;  // frame of a recording
};

// Returns the exit code; throws CommandError.
[[nodiscard]] int localize_pictures(const LocalizeCommand& options);

}  // namespace alidade
