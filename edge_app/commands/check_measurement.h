#pragma once
// What `alidade check` collects from both links in some seconds.
//
// Threads: one reads the video, one reads pan/tilt, and a third examines images. The third always
// takes the latest image, so that it never makes a source drop frames. The last image is kept.

#include <optional>
#include <string>
#include <vector>

#include "edge_app/check/image_check.h"
#include "edge_app/check/video_check.h"
#include "edge_app/config/config.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/video/frame_source.h"

namespace alidade {

// A stream may begin with a burst of pictures that a relay has stored. Losses in the first kStart_s
// are counted separately.
inline constexpr double kStart_s = 2;

struct Connection {
  std::string error;  // why no item, or no further item, came; empty: no error
  int losses = 0;     // after the first item
  std::string loss;   // error text of the last loss
  // What the connected source waited for last before its first item; empty: nothing.
  std::string waited;
  std::vector<std::string> notes;  // what the source found out about its device
  std::string name;                // of the source
};

// The last image that was examined.
struct LastPicture {
  Frame frame;
  // Motion of the scene at the image's centre since the image before; empty: not known.
  std::optional<Vector2<double>> shift_px_s;
};

struct Measured {
  Connection video;
  Connection pan_tilt;
  std::vector<CheckedFrame> frames;
  std::vector<PanTiltSample> samples;
  std::vector<double> delivered_s;  // of each sample: CLOCK_MONOTONIC when the source delivered it
  FrameSourceCounters counters;
  FrameSourceCounters counters_at_start;  // after the first kStart_s
  ImageReport images;
  std::optional<LastPicture> last;  // empty: no image came
};

// Reads each configured stream for duration_s from its first item on. While the video waits for a
// key frame, measure() waits too and says so on stderr; pan/tilt is read meanwhile. Shows its
// progress on a terminal.
[[nodiscard]] Measured measure(const Config& config, double duration_s);

}  // namespace alidade
