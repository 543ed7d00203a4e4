#pragma once
// Checks whether pictures are sent again. A frame rate converter, a night mode or a grabber repeats
// a picture if it has no new one, so the true rate is lower than the frames' rate. Equal pictures
// of a camera at rest show nothing. So a frame is judged only if the head moved the image by 20 px
// or more from 0.25 s before the frame to 0.25 s after it, more than the links' delays differ.
// Radians, seconds, px. Pure; allocates.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "edge_app/check/finding.h"
#include "edge_app/check/video_check.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct RepeatNeeds {
  std::string video;           // of the image
  double focal_length_px = 0;  // from the calibration or the data sheet; the least it may be
};

struct RepeatReport {
  std::size_t turning = 0;   // frames while the head turned
  std::size_t repeated = 0;  // of `turning`: equal to the frame before
  // New pictures a second while the head turned. Empty: fewer than 20 frames came meanwhile.
  std::optional<double> fresh_hz;
  Findings findings;
};

// time_s: one for each frame (VideoReport::time_s). samples: in order of time, without stale
// repeats.
[[nodiscard]] RepeatReport check_repeats(const std::vector<CheckedFrame>& frames,
                                         const std::vector<double>& time_s,
                                         const std::vector<PanTiltSample>& samples,
                                         const RepeatNeeds& needs);

[[nodiscard]] ReportLines describe(const RepeatReport& report);

}  // namespace alidade
