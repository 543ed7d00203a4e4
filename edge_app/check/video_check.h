#pragma once
// What the time stamps of a video stream show: its rate and how even it is, what was lost, how good
// its clock is, and whether this machine keeps up.
//   intervals  of the sender's times, else of the receive times. Their median is the period, their
//              deviation the jitter that remains without the arrival.
//   losses     gaps in the sequence numbers; else in the sender's times if these lie on a steady
//              grid. Gaps in times do not show whether a frame was lost or left out by the camera.
// No interval and no loss reaches across a reconnection.
// Seconds. Pure functions; they allocate and do not throw, whatever the stamps hold.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/model/clock_filter.h"
#include "edge_app/check/clock_check.h"
#include "edge_app/check/finding.h"
#include "edge_app/check/spread.h"
#include "platform/video/frame_source.h"

namespace alidade {

// A frame without its image.
struct CheckedFrame {
  FrameStamp stamp;
  int width = 0;                   // px
  int height = 0;                  // px
  std::optional<double> decode_s;  // s; Frame::decode_s
  bool interlaced = false;         // its coding
  bool repeats = false;            // its image equals the one before exactly
};

struct VideoNeeds {
  std::string source;            // URL or directory
  std::string calibration_name;  // whose size is given below
  int width = 0;                 // px; 0: any
  int height = 0;
  bool images = true;         // OE mode: each frame has to be decoded in time
  bool is_calibrated = true;  // false: the size is the configuration's
};

struct VideoReport {
  std::size_t frames = 0;
  int width = 0;  // px, of the first frame
  int height = 0;
  bool size_fits = true;
  StampedAt stamped_at = StampedAt::kArrival;  // of the last frame
  std::optional<double> rate_hz;               // of the frames that came
  std::optional<Spread> interval_s;            // see above
  std::optional<std::int64_t> lost;            // empty: not known
  bool skips_or_lost = false;                  // `lost` comes from the sender's times
  FrameSourceCounters counters;
  FrameSourceCounters at_start;  // the part of `counters` from the first seconds
  std::optional<Spread> decode_s;
  ClockReport clock;
  std::vector<double> time_s;  // of each frame
  Findings findings;
};

// How many frames are missing between those that came, as described above. Empty: not known.
[[nodiscard]] std::optional<std::int64_t> missing_frames(const std::vector<CheckedFrame>& frames);

// at_start: the part of `counters` from the first seconds. A relay or camera may begin with a burst
// of kept pictures, which overflows the queues of any machine once.
[[nodiscard]] VideoReport check_video(const std::vector<CheckedFrame>& frames,
                                      const FrameSourceCounters& counters,
                                      const FrameSourceCounters& at_start,
                                      const ClockFilterOptions& clock, const VideoNeeds& needs);

[[nodiscard]] ReportLines describe(const VideoReport& report);

}  // namespace alidade
