#pragma once
// What select_input(), the first stage of calibrate(), keeps, and in which order. Allocates.
//   frames         with a finite stamp; of several with the same name, the first. Ordered by
//                  sequence number if all have one, else by stamp
//   telemetry      finite. Ordered likewise; of several with the same sequence number (or stamp, if
//                  that is what orders them), the first
//   observations   finite, sigma > 0, at most 1 px outside the image, in a frame that is kept, of a
//                  landmark that this frame shows once and another frame, too. Ordered by landmark,
//                  then frame

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/calibration/linearisation.h"
#include "core/calibration/stage_status.h"

namespace alidade::internal {

// The least number of landmarks for the adjustment.
inline constexpr std::size_t kMinLandmarks = 8;

// The adjustment's data. For each item of the data: its index in CalibrationInput.
struct SelectedInput {
  AdjustmentData data;
  std::vector<std::size_t> frame_index;        // for data.frame_time_s
  std::vector<std::size_t> telemetry_index;    // for data.telemetry
  std::vector<std::size_t> observation_index;  // for data.observations
  std::vector<std::int64_t> landmark_name;     // for each landmark of data.observations
};

// *selected, *excluded: as constructed. Fills the indices, the names and data.observations;
// fit_clocks() (recording_clocks.h) sets times and telemetry later. *excluded: what is left out.
// kBadInput: fewer than 3 frames or 8 telemetry samples; width or height not positive; an angle
// beyond 2.5 pi rad (degrees?); all observations within 2 px of the corner (normalised?).
// kTooFewLandmarks: fewer than kMinLandmarks. *selected is incomplete after a refusal.
[[nodiscard]] StageStatus select_input(const CalibrationInput& input, SelectedInput* selected,
                                       CalibrationExclusions* excluded);

}  // namespace alidade::internal
