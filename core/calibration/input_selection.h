#pragma once
// First stage of calibrate(): what of the input can be used, in what order, and what is left out and why.
//   frames        with a finite stamp, each name once; by sequence number if all have one, else by stamp
//   telemetry     finite, each number (or stamp) once; likewise ordered
//   observations  finite, with a sigma, inside the image (1 px of margin), in a frame used, of a landmark seen once in the
//                 frame and in two frames or more; by landmark, then by frame
// Refused is what has too little of any, or betrays another unit: degrees, normalised coordinates. Allocates.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/calibration/linearisation.h"
#include "core/calibration/stage_status.h"

namespace alidade::internal {

// Landmarks that the adjustment needs at least.
inline constexpr std::size_t kMinLandmarks = 8;

// What the adjustment is given, and which item of the input each part of it was.
struct SelectedInput {
  AdjustmentData data;
  std::vector<std::size_t> frame_index;        // for data.frame_time_s
  std::vector<std::size_t> telemetry_index;    // for data.telemetry
  std::vector<std::size_t> observation_index;  // for data.observations
  std::vector<std::int64_t> landmark_name;     // for each landmark of data.observations
};

// Fills the indices, the names and data.observations: times are those of clocks (recording_clocks.h). What is left out
// is counted in *excluded.
[[nodiscard]] StageStatus select_input(const CalibrationInput& input, SelectedInput* selected,
                                       CalibrationExclusions* excluded);

}  // namespace alidade::internal
