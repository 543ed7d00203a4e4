#pragma once
// fit_clock_line(): the times of a steady clock from the jittery stamps of a whole recording,
//   stamp_i = offset + period (n_i - n_mean) + noise_i                           (PTCEE 20, 21)
// Symmetric noise: least squares without outliers beyond 5 robust sigmas, joined with the known
// period if there is one. Offset (at n_mean) and period are uncorrelated. One-sided noise: the
// highest line below the stamps (core/model/lower_line.h). The least delay becomes part of the
// clock offset. The line's sigmas follow from the measured number of delays near the least one;
// behind a relay that delays evenly they are few, and the line is less certain.
// n_i are sequence numbers. Unless all stamps have one and they increase, n_i are counted along the
// stamps, gaps included. Stamps that fit no steady clock, or have none (a polled device), stay as
// they are. Allocates.

#include <cstdint>
#include <optional>
#include <vector>

namespace alidade::internal {

struct ClockInput {
  std::vector<double> stamp_s;                        // in the order of the ticks; any clock
  std::vector<std::optional<std::int64_t>> sequence;  // as long as stamp_s
  // Symmetric noise: as stated; empty or contradicted by the residuals: from these.
  std::optional<double> stamp_sigma_s;
  std::optional<double> period_s;  // if known; ticks are counted with it
  // > 0: the known period joins the fit; with one-sided noise it only limits the search.
  std::optional<double> period_sigma_s;
  bool one_sided = false;  // stamps are never early
  bool own_times = false;  // no clock behind the stamps: not steady
};

// If not steady, period_s, middle_s and both their sigmas are 0.
struct ClockLine {
  bool steady = false;
  std::vector<double> time_s;  // as long as stamp_s: on the line; the stamps if not steady
  double period_s = 0;
  double period_sigma_s = 0;
  double middle_s = 0;        // the line's time at n_mean
  double offset_sigma_s = 0;  // of middle_s
  double stamp_sigma_s = 0;   // of one stamp about the line; own_times: as stated, else 0
  int lost = 0;               // ticks between the first and the last stamp that have no stamp
};

// A clock with fewer than three stamps is not steady.
[[nodiscard]] ClockLine fit_clock_line(const ClockInput& input);

}  // namespace alidade::internal
