#pragma once
// Finds keypoint tracks for a calibration in a recording's video, and makes the map that belongs to
// the resulting calibration.
//   first pass   nothing is known of the camera: StartUpTracker
//   second pass  camera, clocks and trajectory of a first calibration are known: OeMode. Its map
//                recognises landmarks when the camera returns to them, so that tracks span the
//                whole recording
// Pixels as in CONVENTIONS.md. sigma_px is sqrt(trace of covariance / 2), that of one component. It
// is the sigma of errors that differ between the observations of one landmark; errors that they
// share are not in it. Reads the whole video on the caller's thread. Throws CommandError if there
// are no images, if they are unreadable or too small, or if recording.yaml states another size.

#include <functional>
#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/realtime/oe_mode/map_state.h"
#include "edge_app/self_calibration/track_choice.h"

namespace alidade {

struct VideoTracks {
  std::vector<CalibrationObservation> observations;
  UntrackedFrames without;           // searched frames without an observation
  std::vector<std::string> remarks;  // about the video, for the report
};

// Called for each frame with the part of the video that is done, 0 to 1.
using VideoProgress = std::function<void(double done)>;

// Whether the recording has video.mkv or frames/.
[[nodiscard]] bool has_video(const std::string& directory);

// Finds tracks in the frames of `input`, whose observations are not used. With `estimate`: second
// pass.
[[nodiscard]] VideoTracks track_video(const std::string& directory, const CalibrationInput& input,
                                      const VideoProgress& progress);
[[nodiscard]] VideoTracks track_video(const std::string& directory, const CalibrationInput& input,
                                      const CalibrationResult& estimate,
                                      const VideoProgress& progress);

// Makes the map of a calibration from at most kMaxKeyframes images, spread evenly over the
// calibrated frames.
inline constexpr std::size_t kMaxKeyframes = 24;
[[nodiscard]] MapState map_video(const std::string& directory, const CalibrationResult& result,
                                 const VideoProgress& progress);

}  // namespace alidade
