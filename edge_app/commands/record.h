#pragma once
// `alidade record`. The command line (command_line.cpp) names the options as here and checks them.

#include <limits>
#include <string>

namespace alidade {

struct RecordOptions {
  std::string config;     // path of alidade.yaml
  std::string directory;  // of the recording; is made if it does not exist
  double duration_s = std::numeric_limits<double>::infinity();  // infinite: until a signal
};

// Stores the live streams as a recording. Returns kExitOk. Throws CommandError if the configuration
// cannot be used, or names a recording or no pan/tilt source; if the directory already holds a
// recording or cannot be made; if a link fails for good, no frame comes, or a file cannot be
// written.
[[nodiscard]] int record_streams(const RecordOptions& options);

}  // namespace alidade
