#pragma once
// Whether pictures are sent again: a converter of frame rates, a night mode or a grabber repeats a picture where it has no
// new one, and the rate is not what it seems. Equal pictures of a camera at rest tell nothing; only frames about which
// the head moved the image by kTurning_px within kAbout_s to both sides are judged.
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
  double focal_length_px = 0;  // of the calibration or the data sheet
};

struct RepeatReport {
  std::size_t turning = 0;   // frames while the head turned
  std::size_t repeated = 0;  // of these, equal to the one before
  std::optional<double> fresh_hz;
  Findings findings;
};

// time_s: of each frame (VideoReport). samples: in order of time, without stale repeats.
[[nodiscard]] RepeatReport check_repeats(const std::vector<CheckedFrame>& frames,
                                         const std::vector<double>& time_s,
                                         const std::vector<PanTiltSample>& samples,
                                         const RepeatNeeds& needs);

[[nodiscard]] ReportLines describe(const RepeatReport& report);

}  // namespace alidade
