#pragma once
// What the stamps of a video stream show: its rate and how even it is, what was lost, what its clock is worth,
// and whether this machine keeps up.
//
//   intervals  of the sender's times; of the receive times where the sender tells none. Their median is the period,
//              their deviation what is left of jitter once the arrival does not matter.
//   losses     gaps in the sequence numbers; else of the sender's times, where these lie on a steady grid
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
};

struct VideoNeeds {
  std::string source;            // whose frames they are: URL or directory
  std::string calibration_name;  // what the size below is of
  int width = 0;                 // px; 0: any
  int height = 0;
  bool images = true;  // OE mode: each frame has to be decoded in time
};

struct VideoReport {
  std::size_t frames = 0;
  int width = 0;  // px, of the first
  int height = 0;
  bool size_fits = true;
  std::optional<double> rate_hz;     // of the frames that came
  std::optional<Spread> interval_s;  // see above
  std::optional<std::int64_t> lost;  // empty: nothing tells
  FrameSourceCounters counters;
  std::optional<Spread> decode_s;
  ClockReport clock;
  std::vector<double> time_s;  // of each frame
  Findings findings;
};

[[nodiscard]] VideoReport check_video(const std::vector<CheckedFrame>& frames,
                                      const FrameSourceCounters& counters,
                                      const ClockFilterOptions& clock, const VideoNeeds& needs);

[[nodiscard]] ReportLines describe(const VideoReport& report);

}  // namespace alidade
