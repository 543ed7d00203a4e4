#pragma once
// `alidade discover`. The command line (command_line.cpp) names the options as here and checks
// them.

#include <string>
#include <vector>

namespace alidade {

struct DiscoverOptions {
  std::string write;  // a configuration to write; empty: none
  std::string device;
  std::string user;
  std::string password_file;
  std::string field_of_view;
  std::string head;
  std::vector<std::string> keys;
  std::string interface;
  double duration_s = 4;  // of the search; 0: the network is not searched
  bool untried = false;
  bool json = false;
};

// Prints what is there, and writes the configuration. Returns the exit code: kExitFailed if nothing
// was found. Throws CommandError.
[[nodiscard]] int discover_cameras(const DiscoverOptions& options);

}  // namespace alidade
