#pragma once
// Keypoint tracks for a calibration, found in a recording's video.
//   first pass   nothing is known of the camera: StartUpTracker
//   second pass  with the camera, the clocks and the trajectory of a first calibration: OeMode, whose map
//                recognises what the camera comes back to, so that tracks span the whole recording
// And the map that belongs to the calibration that came of it.
// Pixels as in CONVENTIONS.md; sigma_px is that of a component, sqrt(trace of covariance / 2), of what
// differs between the observations of one landmark.
// Reads the whole video; throws CommandError (no or unreadable images, or of another size than
// recording.yaml says). Runs on the caller's thread.

#include <functional>
#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/realtime/oe_mode/map_state.h"
#include "edge_app/self_calibration/track_choice.h"

namespace alidade {

struct VideoTracks {
  std::vector<CalibrationObservation> observations;
  UntrackedFrames without;           // frames without an observation, if they were looked for
  std::vector<std::string> remarks;  // about the video, for the report
};

// Called for each frame with the part of the video that is done, 0 to 1.
using VideoProgress = std::function<void(double done)>;

// video.mkv or frames/.
[[nodiscard]] bool has_video(const std::string& directory);

// Of the input's frames; its observations are not looked at.
[[nodiscard]] VideoTracks track_video(const std::string& directory, const CalibrationInput& input,
                                      const VideoProgress& progress);
[[nodiscard]] VideoTracks track_video(const std::string& directory, const CalibrationInput& input,
                                      const CalibrationResult& estimate,
                                      const VideoProgress& progress);

// Of up to kMaxKeyframes images, spread over the calibrated frames.
inline constexpr std::size_t kMaxKeyframes = 24;
[[nodiscard]] MapState map_video(const std::string& directory, const CalibrationResult& result,
                                 const VideoProgress& progress);

}  // namespace alidade
