#pragma once
// `alidade plane`. Its options bear the names of the command line (command_line.cpp), checked there.

#include <string>

namespace alidade {

struct PlaneOptions {
  std::string action;  // fit
  std::string data;    // what is known of the ground, see plane_data.h
  std::string output;  // empty: plane.yaml beside the data
  bool json = false;
};

// Returns the exit code; throws CommandError.
[[nodiscard]] int fit_plane_command(const PlaneOptions& options);

}  // namespace alidade
