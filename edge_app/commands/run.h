#pragma once
// `alidade run`. Its options bear the names of the command line (command_line.cpp), checked there.

#include <limits>
#include <string>

namespace alidade {

struct RunOptions {
  std::string config;
  double duration_s = std::numeric_limits<double>::infinity();
  bool json = false;
  bool csv = false;
};

// Live: a record for each video frame, until it is told to stop. Returns the exit code; throws CommandError.
[[nodiscard]] int run_live(const RunOptions& options);

}  // namespace alidade
