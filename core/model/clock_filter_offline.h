#pragma once
// The clock filter for a whole recording: every item is judged by what came before and after it,
// so its time is better known than the online filter can know it. Same model, options and treatment
// of bad items, restarts and floor shifts as clock_filter.h.

#include <cstddef>
#include <cstdint>

#include "core/model/clock_filter.h"

namespace alidade {

// estimates[i] for item i of n, items in order of arrival. All arrays are the caller's.
inline void filter_clock_offline(const ClockFilterOptions& options, const double* receive_time_s,
                                 const double* sender_time_s, std::size_t n,
                                 ClockEstimate* estimates) {
  ClockFilter<> filter(options);
  for (std::size_t i = 0; i < n; ++i) {
    estimates[i] = filter.update(receive_time_s[i], sender_time_s[i]);
  }
}

inline void filter_clock_offline(const ClockFilterOptions& options, const double* receive_time_s,
                                 const std::int64_t* sequence, std::size_t n,
                                 ClockEstimate* estimates) {
  ClockFilter<> filter(options);
  for (std::size_t i = 0; i < n; ++i) {
    estimates[i] = filter.update_sequence(receive_time_s[i], sequence[i]);
  }
}

}  // namespace alidade
