#pragma once
// `alidade record`. Its options bear the names of the command line (command_line.cpp), checked there.

#include <limits>
#include <string>

namespace alidade {

struct RecordOptions {
  std::string config;
  std::string directory;
  double duration_s = std::numeric_limits<double>::infinity();
};

// The live streams as a recording. Returns the exit code; throws CommandError.
[[nodiscard]] int record_streams(const RecordOptions& options);

}  // namespace alidade
