#pragma once
// `alidade record`. The command line (command_line.cpp) names the options as here and checks them.

#include <limits>
#include <string>

namespace alidade {

struct RecordOptions {
  std::string config;
  std::string directory;
  double duration_s = std::numeric_limits<double>::infinity();
};

// Stores the live streams as a recording. Returns the exit code; throws CommandError.
[[nodiscard]] int record_streams(const RecordOptions& options);

}  // namespace alidade
