#pragma once
// From the stamps of a stream to the times at which a steady clock ticked, with what is not known about
// it: for a whole recording the clock is one straight line,
//   stamp_i = offset + period (n_i - n_mean) + noise_i                           (PTCEE 20, 21)
// kSymmetric: weighted least squares with a redescending weight, joined with the measured period if
// there is one; offset and period are then uncorrelated. kOneSided: the highest line below the
// stamps (core/model/lower_line.h); its constant least delay becomes part of the clock offset.
// n_i are sequence numbers or, without them, counted along the stamps, gaps included. Stamps that do
// not fit a steady clock are kept as they are, and that is said; so are those that have none behind them (a
// polled device). Allocates.

#include <cstdint>
#include <optional>
#include <vector>

namespace alidade::internal {

struct ClockInput {
  std::vector<double> stamp_s;                        // increasing
  std::vector<std::optional<std::int64_t>> sequence;  // as long as stamp_s
  std::optional<double> stamp_sigma_s;
  std::optional<double> period_s;
  std::optional<double> period_sigma_s;
  bool one_sided = false;
  bool own_times = false;  // no clock behind the stamps
};

struct ClockLine {
  bool steady = false;
  std::vector<double> time_s;  // on the line; the stamps if not steady
  double period_s = 0;
  double period_sigma_s = 0;
  double middle_s = 0;  // where offset and period are uncorrelated
  double offset_sigma_s = 0;
  double stamp_sigma_s = 0;
  int lost = 0;
};

[[nodiscard]] ClockLine fit_clock_line(const ClockInput& input);

}  // namespace alidade::internal
