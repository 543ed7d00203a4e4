#pragma once
// How good a stream's time stamps are: runs the pipeline's own clock filter (capture_clock.h) over
// them.
//   lateness  of an item: receive time minus the filter's final line at the item's sender time or
//             count
//   raw rate  host seconds per sender second: the median slope over half of the stream, without the
//             filter's prior. It reveals stamps that are not a clock's; the filter, which assumes
//             quartz, does not reveal them.
// Seconds. Pure functions; they allocate and do not throw, whatever the stamps hold.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/model/clock_filter.h"
#include "edge_app/check/finding.h"
#include "edge_app/check/spread.h"

namespace alidade {

enum class StampKind : std::uint8_t { kArrival, kSequence, kSender };

// The filter's result for a stream's stamps.
struct ClockReport {
  StampKind kind = StampKind::kArrival;
  ClockState state = ClockState::kWarmingUp;
  double rate_error = 0;   // host s per sender s, minus 1, by the filter; 0 for counts
  double period_s = 0;     // of one count, by the filter
  double sigma_s = 0;      // of the line at the last item
  ClockCounters counters;  // without restarts at a reconnection
  double delay_shift_s = 0;
  std::optional<Spread> lateness_s;
  // The raw rate minus 1, with its standard deviation: shows a broken clock.
  std::optional<double> raw_rate_error;
  double raw_rate_sigma = 0;
  // False: the stamps are not times (see judge_clock()), and the items' times are their arrivals.
  bool usable = true;
  bool counts = false;  // not usable because they count items
};

// The stamps of one item.
struct ClockedStamp {
  double receive_time_s = 0;
  std::optional<double> sender_time_s;
  std::optional<std::int64_t> sequence;
  bool restarted = false;
};

// *time_s (if not null): each item's time by the final line, or its receive time if there is no
// usable clock.
[[nodiscard]] ClockReport check_clock(const std::vector<ClockedStamp>& stamps,
                                      const ClockFilterOptions& options,
                                      std::vector<double>* time_s = nullptr);

// `what`: "video URL". Stamps that are not a clock's, or that jump, are a problem. A step of the
// least delay is advice.
void judge_clock(const ClockReport& clock, const std::string& what, Findings* findings);

// In words; empty if the stamps are times, or there are none.
[[nodiscard]] std::string why_no_times(const ClockReport& clock);

[[nodiscard]] std::string describe(const ClockReport& clock);

}  // namespace alidade
