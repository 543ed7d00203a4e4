#pragma once
// What the stamps of a video stream show: its rate and how even it is, what was lost, what its clock is worth,
// and whether this machine keeps up.
//
//   intervals  of the sender's times; of the receive times where the sender tells none. Their median is the period,
//              their deviation what is left of jitter once the arrival does not matter.
//   losses     gaps in the sequence numbers; else of the sender's times, where these lie on a steady grid: there nothing
//              tells a frame that was lost from one that the camera left out
// Frames after a reconnection begin anew: no interval and no loss reaches across.
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
  int width = 0;
  int height = 0;
  std::optional<double> decode_s;
  bool interlaced = false;  // its coding
  bool repeats = false;     // its image is exactly the one before
};

struct VideoNeeds {
  std::string source;            // whose frames they are: URL or directory
  std::string calibration_name;  // what the size below is of
  int width = 0;                 // px; 0: any
  int height = 0;
  bool images = true;         // OE mode: each frame has to be decoded in time
  bool is_calibrated = true;  // false: the size is the configuration's
};

struct VideoReport {
  std::size_t frames = 0;
  int width = 0;  // px, of the first
  int height = 0;
  bool size_fits = true;
  StampedAt stamped_at = StampedAt::kArrival;  // of the last
  std::optional<double> rate_hz;               // of the frames that came
  std::optional<Spread> interval_s;            // see above
  std::optional<std::int64_t> lost;            // empty: nothing tells
  bool skips_or_lost = false;                  // they are told by the sender's times
  FrameSourceCounters counters;
  FrameSourceCounters at_start;  // of these, in the first seconds
  std::optional<Spread> decode_s;
  ClockReport clock;
  std::vector<double> time_s;  // of each frame
  Findings findings;
};

// at_start: the part of counters that was counted in the first seconds. A relay or camera may begin with a burst of kept
// pictures, which overflows queues of any machine, and once.
[[nodiscard]] VideoReport check_video(const std::vector<CheckedFrame>& frames,
                                      const FrameSourceCounters& counters,
                                      const FrameSourceCounters& at_start,
                                      const ClockFilterOptions& clock, const VideoNeeds& needs);

[[nodiscard]] ReportLines describe(const VideoReport& report);

}  // namespace alidade
