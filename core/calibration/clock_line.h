#pragma once
// fit_clock_line(): the times of a steady clock from the jittery stamps of a whole recording,
//   stamp_i = offset + period (n_i - n_mean) + noise_i                           (PTCEE 20, 21)
// Symmetric noise: least squares without outliers beyond 5 robust sigmas, joined with the known
// period if there is one. Offset and period are then uncorrelated. one_sided: the highest line
// below the stamps (core/model/lower_line.h); its constant least delay becomes part of the clock
// offset. How sure it is depends on how many delays come near the least one, as measured: behind a
// relay that delays evenly they are few.
// n_i are sequence numbers or, without them, counted along the stamps with gaps. Stamps that fit no
// steady clock, or have none (a polled device), stay as they are. Allocates.

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
