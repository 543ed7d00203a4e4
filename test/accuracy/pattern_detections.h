#pragma once
// How well the points of a printed pattern are found in rendered frames of the virtual camera (test/simulator), by pattern, motion,
// exposure and noise: against the simulator's own truth.

#include <string>
#include <vector>

#include "core/pattern/known_pattern.h"
#include "test/accuracy/table.h"
#include "test/simulator/config.h"

namespace alidade::test {

// The same pattern as a person names it, and as the virtual camera has it.
struct PatternUnderTest {
  std::string name;  // of parse_pattern
  simulator::PatternConfig::Kind kind;
  int columns, rows;
  double size_m;
};
[[nodiscard]] const std::vector<PatternUnderTest>& patterns_under_test();
[[nodiscard]] KnownPattern known(const PatternUnderTest& pattern);

// 752x480, 51.56 us, before this pattern.
[[nodiscard]] simulator::Config pattern_scene(const PatternUnderTest& pattern);

struct DetectionErrors {
  int frames = 0, frames_found = 0;
  int seen = 0, found = 0;  // points in the image, and of them found
  int wrong = 0;            // more than half a pixel off
  double rms_px = 0;        // of a coordinate, without the wrong ones
  double along_px = 0;      // mean along the image's motion
  double correlation = 0;   // of a point's error with its own in the frame before
  double cpu_ms = 0;        // a frame
};
[[nodiscard]] DetectionErrors detection_errors(const simulator::Config& config,
                                               const KnownPattern& pattern, int frames,
                                               double interval_s);

[[nodiscard]] Table detection_table(int frames);

}  // namespace alidade::test
