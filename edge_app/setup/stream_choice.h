#pragma once
// Which of a camera's streams, or of a USB camera's modes, to take, and why. Pure functions.
//
// More pixels give finer directions, up to what a small computer decodes and follows in time
// (1920x1080); fewer than 15 pictures a second leave movements between them unseen. Among equals:
// H.264 before H.265 before JPEG, no B-frames, more pictures a second up to 30.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "platform/discovery/device_report.h"
#include "platform/video/v4l2_mode.h"

namespace alidade {

struct StreamChoice {
  std::optional<std::size_t> best;   // empty: none can be used
  std::string reason;                // one line: why this one, or why none
  std::vector<std::string> remarks;  // one for each stream: why not this one, or what to set
};

[[nodiscard]] StreamChoice choose_stream(const std::vector<VideoStream>& streams);

// A mode of a V4L2 device.
struct V4l2Mode {
  V4l2Format format = V4l2Format::kGrey;
  int width = 0;  // px
  int height = 0;
  double rate_hz = 0;  // 0: the driver lists none
};

// All modes of formats that can be used, the best first. Empty: none.
[[nodiscard]] std::vector<V4l2Mode> ordered_modes(const std::vector<V4l2Offer>& offers);

}  // namespace alidade
