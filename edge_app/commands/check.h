#pragma once
// `alidade check`. The command line (command_line.cpp) names the options as here and checks them.

#include <string>

namespace alidade {

struct CheckOptions {
  std::string config;
  double duration_s = 10;
  bool json = false;
};

// Checks the configuration and what its links send. Returns the exit code; throws CommandError.
[[nodiscard]] int check_links(const CheckOptions& options);

}  // namespace alidade
