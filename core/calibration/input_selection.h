#pragma once
// select_input(): first stage of calibrate(). Selects and orders the usable input.
//   frames         finite stamp, the first of each name; ordered by sequence number if all have
//                  one, else by stamp
//   telemetry      finite; ordered likewise; the first of each sequence number (or else stamp)
//   observations   finite, sigma > 0, in the image or up to 1 px outside of it, in a used frame
//                  that shows its landmark once, of a landmark in two frames or more; ordered by
//                  landmark, then frame
// Refuses fewer than 3 frames, 8 telemetry samples or kMinLandmarks landmarks, an empty image, and
// other units: angles beyond 2.5 pi (degrees), normalised coordinates. Allocates.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/calibration/linearisation.h"
#include "core/calibration/stage_status.h"

namespace alidade::internal {

// The least number of landmarks for the adjustment.
inline constexpr std::size_t kMinLandmarks = 8;

// The adjustment's data, and the index into the input of each item.
struct SelectedInput {
  AdjustmentData data;
  std::vector<std::size_t> frame_index;        // for data.frame_time_s
  std::vector<std::size_t> telemetry_index;    // for data.telemetry
  std::vector<std::size_t> observation_index;  // for data.observations
  std::vector<std::int64_t> landmark_name;     // for each landmark of data.observations
};

// *selected: empty. Fills the indices, the names and data.observations. Times and telemetry are set
// later, by fit_clocks() (recording_clocks.h). *excluded counts what is left out.
[[nodiscard]] StageStatus select_input(const CalibrationInput& input, SelectedInput* selected,
                                       CalibrationExclusions* excluded);

}  // namespace alidade::internal
