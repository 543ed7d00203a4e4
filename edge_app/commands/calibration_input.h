#pragma once
// From a recording's files to what calibrate() takes. Without tracks.csv its video must hold them. Stamps and counts: see
// calibration_streams.h.

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
  CalibrationInput input;
  CalibrationOptions options;
  KnownCamera known;  // beside the options
  CalibrationValues guess;
  bool tracks_from_video = false;  // input.observations are still to be found in the video
  std::optional<UntrackedFrames>
      untracked;                     // frames without one, where they were found in the video
  std::optional<double> zoom;        // the reading that all of it has, device units
  std::vector<std::string> remarks;  // about the recording, for the report
  // Of the zoom, from the stretch of the job before to this one's, where there are tracks of it or pictures.
  std::optional<ZoomMovement> movement;
  // The frames in whose pictures its tracks are still to be found; none if it has them, or takes too long.
  CalibrationInput movement_pictures;
};

// The recording, or, if its zoom moves, each stretch in which the reading stands still for kLeastStretch_s, less
// kZoomMargin_s at either end, as image and telemetry are not yet known to be of one clock. With what it says of its stamps
// and scales in the options. zoom_tolerance: device units within which two readings are one; none:
// as their jitter shows. Throws CommandError.
inline constexpr double kLeastStretch_s = 6;
inline constexpr double kZoomMargin_s = 1;
[[nodiscard]] std::vector<CalibrationJob> load_calibration_jobs(
    const std::string& directory, std::optional<double> zoom_tolerance = std::nullopt);

}  // namespace alidade
