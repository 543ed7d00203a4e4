// The times that a polled device tells, any at all: the verdict stands once it has come, and nothing that
// goes backwards, runs ahead or tells whole seconds only is found useful.

#include <optional>

#include "platform/pan_tilt/device_clock_trial.h"
#include "test/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  using Verdict = DeviceClockTrial::Verdict;
  FuzzInput input(data, size);
  DeviceClockTrial trial;
  Verdict verdict = Verdict::kOpen;
  double host_s = 0;
  std::optional<double> before_s;
  bool backwards = false;
  bool fine = false;
  while (!input.empty()) {
    const unsigned bits = input.byte();
    host_s += bits % 64 / 16.0;
    const double told_s = input.number();
    const bool tells = (bits & 128U) == 0 && std::isfinite(told_s);
    const Verdict now = trial.add(tells ? std::optional(told_s) : std::nullopt, host_s);
    backwards = backwards || !tells || (before_s && told_s < *before_s);
    fine = fine || told_s != std::floor(told_s);
    before_s = told_s;
    FUZZ_REQUIRE(verdict == Verdict::kOpen || now == verdict);
    if (verdict == Verdict::kOpen && now == Verdict::kUseful) FUZZ_REQUIRE(!backwards && fine);
    verdict = now;
  }
  return 0;
}
