#pragma once
// `alidade check`. Its options bear the names of the command line (command_line.cpp), checked there.

#include <string>

namespace alidade {

struct CheckOptions {
  std::string config;
  double duration_s = 10;
  bool json = false;
};

// What is configured, and what its links send. Returns the exit code; throws CommandError.
[[nodiscard]] int check_links(const CheckOptions& options);

}  // namespace alidade
