#pragma once
// `alidade localize`: finds where pictures look by a scene map; one line of JSON for each. The
// command line (command_line.cpp) names the options as here.

#include <string>
#include <vector>

namespace alidade {

struct LocalizeCommand {
  std::string map;                    // a scene map's file
  std::vector<std::string> pictures;  // files, or directories of recordings
  // A file that gives f for a zoom reading, clock offset and axes. Empty: the axes are nominal, and
  // the zoom reading gives no focal length.
  std::string calibration;
  bool no_telemetry = false;
  int every = 1;  // use each n-th frame of a recording; 1 or more
};

// Returns kExitOk, also for pictures that are not found. Throws CommandError if the map, a picture,
// a recording or the calibration cannot be used, a picture has another size than the map's, or
// stdout cannot be written.
[[nodiscard]] int localize_pictures(const LocalizeCommand& options);

}  // namespace alidade
