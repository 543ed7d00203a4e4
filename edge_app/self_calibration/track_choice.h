#pragma once
// Which of the tracks that were found an adjustment is given, so that it ends in reasonable time: live and from a recording.
//   pixels    two landmarks may be one corner: one of them is left in a frame
//   sightings landmarks seen kMinSightings times or more
//   limit     if those are more than max_observations, evenly over the recording's frames: as many landmarks in each as fit, of
//             these the ones that moved farthest through the image, each with all of its sightings. Where fewer than
//             kLeastInAFrame would be left in a frame, every second frame counts, or every third, ...
// Pure functions; they allocate.

#include <cstddef>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "core/calibration/calibrate.h"

namespace alidade {

// Two landmarks may be one corner, seen in two octaves: the noise of its pixels is in both, which are then no two
// observations (docs/calibration.md). Of those of a frame that lie closer than this one is left, that of the landmark
// with the most information; by frame.
inline constexpr double kSharedPixels_px = 8;
[[nodiscard]] std::vector<CalibrationObservation> without_shared_pixels(
    std::vector<CalibrationObservation> observations);

// Why a frame has none of the tracks.
enum class Untracked {
  kNoPicture,    // it is missing or could not be decoded
  kNoTelemetry,  // nobody looked for points in it, as nothing tells where it looks
  kNoPoint,      // none was found or followed
  kTooShort,     // followed through fewer than kMinSightings frames
  kBeyondLimit,  // of more than max_observations
};
using UntrackedFrames = std::unordered_map<std::int64_t, Untracked>;

inline constexpr int kMinSightings = 5;
inline constexpr std::size_t kMaxObservations = 30000;
inline constexpr std::size_t kLeastInAFrame = 12;
// *untracked: gets the frames of the observations of which none is left, if it is not null.
[[nodiscard]] std::vector<CalibrationObservation> choose_tracks(
    std::vector<CalibrationObservation> observations,
    std::size_t max_observations = kMaxObservations, UntrackedFrames* untracked = nullptr);

}  // namespace alidade
