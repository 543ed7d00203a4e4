#pragma once
// Chooses the tracks that an adjustment uses, so that it ends in reasonable time, live and from a
// recording. Pure functions; they allocate.
//   pixels     two landmarks may be one corner: only one of them is kept in a frame
//   sightings  landmarks seen kMinSightings times or more
//   limit      if there are more than max_observations: the same number of landmarks in each frame,
//              those that moved farthest through the image first, each with all of its sightings.
//              If fewer than kLeastInAFrame would be left in a frame, only every second frame
//              counts, or every third, ...

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/calibration/calibrate.h"

namespace alidade {

// Two landmarks may be one corner, seen in two octaves. They share the noise of the corner's
// pixels, so they are not two observations (docs/calibration.md). Of the observations of a frame
// that lie closer together than this, only the one of the landmark with the most information is
// kept. The result is sorted by frame.
inline constexpr double kSharedPixels_px = 8;
[[nodiscard]] std::vector<CalibrationObservation> without_shared_pixels(
    std::vector<CalibrationObservation> observations);

// Why a frame has no tracks left.
enum class Untracked {
  kNoPicture,    // missing, or could not be decoded
  kNoTelemetry,  // no points were looked for, as nothing says where the frame looks
  kNoPoint,      // no point was found or followed
  kTooShort,     // followed through fewer than kMinSightings frames
  kBeyondLimit,  // left out because of max_observations
};
// Key: CalibrationFrame::frame.
using UntrackedFrames = std::unordered_map<std::int64_t, Untracked>;

inline constexpr int kMinSightings = 5;
inline constexpr std::size_t kMaxObservations = 30000;
inline constexpr std::size_t kLeastInAFrame = 12;
// *untracked, if not null: gets each frame of the observations of which none is left, as kTooShort
// or kBeyondLimit.
[[nodiscard]] std::vector<CalibrationObservation> choose_tracks(
    std::vector<CalibrationObservation> observations,
    std::size_t max_observations = kMaxObservations, UntrackedFrames* untracked = nullptr);

}  // namespace alidade
