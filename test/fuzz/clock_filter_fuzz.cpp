// The clock filter of a stream, fed with any stamps: it always answers with a finite time and a sigma.

#include "core/model/clock_filter.h"
#include "test/fuzz/stamps.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  constexpr double kMost = 9007199254740991.0;  // of a sequence
  FuzzInput input(data, size);
  const unsigned bits = input.byte();
  ClockFilterOptions options;
  options.jitter = (bits & 1U) != 0 ? ClockJitter::kSymmetric : ClockJitter::kOneSided;
  options.nominal_period_s = (bits & 2U) != 0 ? 0.04 : 0;
  options.window_s = (bits & 4U) != 0 ? 2 : 60;
  options.settle_s = (bits & 4U) != 0 ? 0.5 : 10;
  const bool counted = (bits & 8U) != 0;
  FUZZ_REQUIRE(options.validate());
  ClockFilter<> filter(options);
  double receive_s = 1000;
  double sender = counted ? 7 : 500;
  while (!input.empty()) {
    const double next_receive_s = next_stamp(receive_s, &input);
    const double next_sender = next_stamp(sender, &input);
    const double count = std::floor((next_sender - sender) / 0.04) + sender;
    ClockEstimate estimate;
    if (!counted) {
      estimate = filter.update(next_receive_s, next_sender);
    } else if (std::abs(count) < kMost) {
      estimate = filter.update_sequence(next_receive_s, static_cast<std::int64_t>(count));
    } else {
      continue;
    }
    FUZZ_REQUIRE(std::isfinite(estimate.time_s));
    FUZZ_REQUIRE(std::isfinite(estimate.sigma_s) && estimate.sigma_s >= 0);
    if (std::isfinite(next_receive_s)) receive_s = next_receive_s;
    if (std::isfinite(next_sender)) sender = counted ? count : next_sender;
  }
  FUZZ_REQUIRE(filter.counters().rejected <= filter.counters().items);
  return 0;
}
