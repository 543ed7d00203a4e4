#pragma once
// Reads a recording's files as input for calibrate(). Without tracks.csv the tracks must be found
// in its video. Time stamps and frame counts: calibration_streams.h.

#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/calibration/known_camera.h"
#include "core/calibration/zoom_movement.h"
#include "edge_app/config/value_file.h"
#include "edge_app/self_calibration/track_choice.h"

namespace alidade {

struct CalibrationJob {
  std::string recording;  // directory
  CalibrationInput input;
  CalibrationOptions options;
  KnownCamera known;               // priors from a lens.yaml, in addition to the options
  CalibrationValues guess;         // what the recording states of the camera, in guess.yaml
  bool tracks_from_video = false;  // input.observations must still be found in the video
  // Frames without an observation; set where tracks were found in the video.
  std::optional<UntrackedFrames> untracked;
  std::optional<double> zoom;        // device units, the one reading of all frames
  std::vector<std::string> remarks;  // about the recording, for the report
  // The movement of the zoom from the dwell of the job before to this one. Set if there are tracks
  // of it, or a video.
  std::optional<ZoomMovement> movement;
  // The frames in which the tracks of `movement` must still be found. No frames if `movement` has
  // tracks, or takes longer than kLongestMovement_s.
  CalibrationInput movement_pictures;
};

// One job for the whole recording; if its zoom moves, one job for each dwell. A dwell is a time of
// at least kZoomRestLeast_s in which the reading stands still. Frames within kZoomMargin_s of the
// beginning or the end of a dwell are left out, as the offset between the clocks of image and
// telemetry is not known yet. The options hold what the recording states of its time stamps and
// scales. zoom_tolerance: device units; readings that differ by no more are one zoom; empty: found
// from their jitter. Throws CommandError if a file that a calibration needs is missing or cannot be
// read, more than a tenth of the tracked points lie outside the image, or the zoom moves and no
// dwell is long enough.
inline constexpr double kZoomMargin_s = 1;
[[nodiscard]] std::vector<CalibrationJob> load_calibration_jobs(
    const std::string& directory, std::optional<double> zoom_tolerance = std::nullopt);

}  // namespace alidade
