#pragma once
// A printed pattern before the virtual camera as tests and experiments begin with it: 752x480 at 20 frames/s.

#include "test/simulator/config.h"

namespace alidade::simulator {

[[nodiscard]] inline Config pattern_scene(PatternConfig::Kind kind, int columns, int rows,
                                          double size_m) {
  Config config;
  config.image = {752, 480, 20};
  config.pattern.emplace();
  config.pattern->kind = kind;
  config.pattern->columns = columns;
  config.pattern->rows = rows;
  config.pattern->size = size_m;
  return config;
}

}  // namespace alidade::simulator
