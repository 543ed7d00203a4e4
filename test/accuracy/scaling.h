#pragma once
// CPU time of one calibration as the recording grows: the published path for 10, 20, 40 and 80 s.

#include <cstdint>

#include "test/accuracy/report.h"

namespace alidade::test {

void run_scaling(int runs, std::uint64_t first_seed, Report* report);

}  // namespace alidade::test
