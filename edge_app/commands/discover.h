#pragma once
// `alidade discover`. The command line (command_line.cpp) names the options as here and checks
// them.

#include <string>
#include <vector>

namespace alidade {

struct DiscoverOptions {
  std::string write;  // a configuration to write; empty: none
  // device to keys: as in CameraSetupOptions.
  std::string device;
  std::string user;
  std::string password_file;
  std::string field_of_view;
  std::string head;
  std::vector<std::string> keys;
  std::string interface;  // to search on: "eth0"; empty: all but the loopback
  double duration_s = 4;  // of the search; 0: the network is not searched
  bool untried = false;   // write without trying the links
  bool json = false;
};

// Prints what is there, and writes the configuration if `write` names one. Returns kExitOk. Throws
// CommandError if no password can be had, `device` is not an address, a login does not say which of
// several cameras it is for, or the configuration cannot be made (set_up_camera()). Without `write`
// also if nothing was found.
[[nodiscard]] int discover_cameras(const DiscoverOptions& options);

}  // namespace alidade
