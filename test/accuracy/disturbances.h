#pragma once
// Base recordings with one thing wrong at a time: where the authors' program breaks, and more. The same
// draws and the same noise in every row, so that rows can be compared run by run.

#include <cstdint>

#include "test/accuracy/report.h"

namespace alidade::test {

void run_disturbances(int runs, std::uint64_t first_seed, Report* report);

}  // namespace alidade::test
