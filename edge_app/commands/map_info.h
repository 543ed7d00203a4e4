#pragma once
// `alidade map info` and `map check`: what a scene map holds, and whether it contradicts itself.

#include <string>

namespace alidade {

struct MapInfoCommand {
  std::string map;  // a scene map's file
  bool json = false;
};

// Both return kExitOk, and throw CommandError if the map cannot be read or stdout cannot be
// written. check_map() also throws it if the map contradicts itself: a residual (map_residual_px())
// of 1 % of the image's width or more.
[[nodiscard]] int show_map(const MapInfoCommand& options);
[[nodiscard]] int check_map(const MapInfoCommand& options);

}  // namespace alidade
