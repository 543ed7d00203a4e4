#pragma once
// `alidade map info` and `map check`: what a scene map holds, and whether it contradicts itself.

#include <string>

namespace alidade {

struct MapInfoCommand {
  std::string map;  // a scene map's file
  bool json = false;
};

// Return the exit code; throw CommandError.
[[nodiscard]] int show_map(const MapInfoCommand& options);
[[nodiscard]] int check_map(const MapInfoCommand& options);

}  // namespace alidade
