#pragma once
// What `alidade check` collects from both links for some seconds.
//
// Threads: video and pan/tilt are read by one each; images are looked at by a third, which takes the latest when it is
// done with the one before, so that looking never makes a source drop frames. Of the images the last one is kept.

#include <optional>
#include <string>
#include <vector>

#include "edge_app/check/image_check.h"
#include "edge_app/check/video_check.h"
#include "edge_app/config/config.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/video/frame_source.h"

namespace alidade {

// A stream may begin with a burst of pictures that a relay had kept.
inline constexpr double kStart_s = 2;

// What became of one connection.
struct Connection {
  std::string error;  // why nothing came, or no more; empty: none
  int losses = 0;     // after the first item
  std::string loss;   // the last one's words
  // What the source waited for last, though the connection stood, before its first item; empty: nothing.
  std::string waited;
  std::vector<std::string> notes;  // what it found out of its device
  std::string name;
};

// The last image that was looked at.
struct LastPicture {
  Frame frame;
  std::optional<Vector2<double>>
      shift_px_s;  // of its centre, since the one before; none: not known
};

struct Measured {
  Connection video;
  Connection pan_tilt;
  std::vector<CheckedFrame> frames;
  std::vector<PanTiltSample> samples;
  std::vector<double> delivered_s;  // each of them
  FrameSourceCounters counters;
  FrameSourceCounters counters_at_start;  // after the first kStart_s
  ImageReport images;
  std::optional<LastPicture> last;
};

// Each stream (no telemetry, by configuration, is none) for duration_s from its first item on. A video that waits for a key frame is waited for, which is said on
// stderr; pan/tilt is read meanwhile. Shows its progress on a terminal.
[[nodiscard]] Measured measure(const Config& config, double duration_s);

}  // namespace alidade
