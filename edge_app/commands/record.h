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

// Stores the live streams as a recording. Returns the exit code. Throws CommandError, also if the
// directory already holds a recording.
[[nodiscard]] int record_streams(const RecordOptions& options);

}  // namespace alidade
