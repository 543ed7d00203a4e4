#pragma once
// What a stream's stamps are worth: the pipeline's own clock filter (capture_clock.h) run over them, and what its line
// leaves over.
//
//   lateness  of an item: its receive time less the filter's last line at its sender's time (or count)
//   raw rate  host seconds a sender's second by the median slope over half of the stream, without the filter's prior: a
//             clock that is none shows there, and not in a filter that believes in quartz
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

// What the filter makes of a stream's stamps.
struct ClockReport {
  StampKind kind = StampKind::kArrival;
  ClockState state = ClockState::kWarmingUp;
  double rate_error = 0;   // host seconds a sender's second, less 1, by the filter; 0 for counts
  double period_s = 0;     // of a count, by the filter
  double sigma_s = 0;      // of the line at the last item
  ClockCounters counters;  // restarts at a reconnection not included
  double delay_shift_s = 0;
  std::optional<Spread> lateness_s;
  // The same rate without the filter's prior, with its standard deviation: what a broken clock shows.
  std::optional<double> raw_rate_error;
  double raw_rate_sigma = 0;
  // False: its stamps are no times (see judge_clock); those of the items are their arrivals.
  bool usable = true;
  bool counts = false;  // because they count items
};

// An item of a stream as its clock sees it.
struct ClockedStamp {
  double receive_time_s = 0;
  std::optional<double> sender_time_s;
  std::optional<std::int64_t> sequence;
  bool restarted = false;
};

// *time_s (if not null): each item's time by the last line; the receive time without a clock, or
// with one that cannot be one.
[[nodiscard]] ClockReport check_clock(const std::vector<ClockedStamp>& stamps,
                                      const ClockFilterOptions& options,
                                      std::vector<double>* time_s = nullptr);

// `what`: "video URL". A clock that cannot be one, or that jumps, is a problem; a minimum delay that shifts, advice.
void judge_clock(const ClockReport& clock, const std::string& what, Findings* findings);

// In words; empty: its stamps are times, or it bears none.
[[nodiscard]] std::string why_no_times(const ClockReport& clock);

[[nodiscard]] std::string describe(const ClockReport& clock);

}  // namespace alidade
