#pragma once
// What the stamps of a video stream show: its rate and how even it is, what was lost, what its clock is worth,
// and whether this machine keeps up.
//
//   clock      the stamps run through the pipeline's own filter (stream_clock.h); lateness of a frame is its receive
//              time less the filter's last line at its sender's time (or count)
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
#include "edge_app/check/finding.h"
#include "edge_app/check/spread.h"
#include "platform/video/frame_source.h"

namespace alidade {

// A frame without its picture.
struct CheckedFrame {
  FrameStamp stamp;
  int width = 0;
  int height = 0;
  std::optional<double> decode_s;
};

struct VideoNeeds {
  std::string source;            // whose frames they are: URL or directory
  std::string calibration_name;  // what the size below is of
  int width = 0;                 // px; 0: any
  int height = 0;
  bool pictures = true;  // OE mode: each frame has to be decoded in time
};

enum class StampKind : std::uint8_t { kArrival, kSequence, kSender };

// What the filter makes of a stream's stamps.
struct ClockReport {
  StampKind kind = StampKind::kArrival;
  ClockState state = ClockState::kWarmingUp;
  double rate_error = 0;   // host seconds a sender's second, less 1, by the filter; 0 for counts
  double period_s = 0;     // of a count, by the filter
  double sigma_s = 0;      // of the line at the last item
  ClockCounters counters;  // restarts at a reconnection not included
  double floor_shift_s = 0;
  std::optional<Spread> lateness_s;
  // The same rate without the filter's prior, with its standard deviation: what a broken clock shows.
  std::optional<double> raw_rate_error;
  double raw_rate_sigma = 0;
};

// An item of a stream as its clock sees it.
struct ClockedStamp {
  double receive_time_s = 0;
  std::optional<double> sender_time_s;
  std::optional<std::int64_t> sequence;
  bool restarted = false;
};

// *time_s (if not null): each item's time by the last line; the receive time without a clock.
[[nodiscard]] ClockReport check_clock(const std::vector<ClockedStamp>& stamps,
                                      const ClockFilterOptions& options,
                                      std::vector<double>* time_s = nullptr);

// `what`: "video URL". A clock that cannot be one, or that jumps, is a problem; a floor that shifts, advice.
void judge_clock(const ClockReport& clock, const std::string& what, Findings* findings);

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

// For a person: label and text.
using ReportLines = std::vector<std::pair<std::string, std::string>>;
[[nodiscard]] ReportLines describe(const VideoReport& report);
[[nodiscard]] std::string describe(const ClockReport& clock);

}  // namespace alidade
