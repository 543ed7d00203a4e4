#pragma once
// Line delay and lens from rendered video of a printed pattern, as `alidade calibrate-shutter` makes them, against the truth.
//   patterns   chessboard, asymmetric circles, AprilGrid with kalibr's corner squares, by turns
//   exposures  2 to 16 ms; noise of 1 to 3 grey levels, JPEG 95; 5 % of the frames lost, stamps that jitter by 1 ms
//   views      the hand's reach takes the pattern out of the image in part; a finger goes round on the board
//   read-outs  51.56 us (20 frames a second), 27 and -60 us, 82.5 (12), 0

#include <filesystem>
#include <optional>
#include <string>

#include "core/pattern/calibrate_pattern.h"
#include "test/simulator/config.h"

namespace alidade::test {

inline constexpr int kPatternRecordings = 20;

struct PatternRecording {
  std::string name;     // for people
  std::string pattern;  // of parse_pattern
  simulator::Config config;
};

// number: from 0, each another.
[[nodiscard]] PatternRecording pattern_recording(int number);

[[nodiscard]] LensVector lens_truth(const simulator::Config& config);

struct PatternOutcome {
  PatternCalibration calibration;
  int images = 0, found = 0;
  double detection_cpu_s = 0, adjustment_cpu_s = 0;
};

// Writes the recording into `folder`, which must not exist, finds lens and line delay from its video file alone, removes it.
[[nodiscard]] PatternOutcome calibrate_pattern_recording(const PatternRecording& recording,
                                                         const std::filesystem::path& folder);

}  // namespace alidade::test
