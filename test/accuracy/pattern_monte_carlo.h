#pragma once
// Is the calibration by a known pattern efficient and honest? Recordings of each setting, their errors against the bound and
// against what was stated. The paper's Tables 1 and 2 come from the same runs.

#include <ostream>
#include <string>
#include <vector>

#include "test/accuracy/pattern_runs.h"

namespace alidade::test {

struct PatternRuns {
  PatternSetting setting;
  std::vector<PatternRun> runs;
};

// Seeds first_seed, first_seed + 1, ..., a thousand further for each setting; each run is told to `progress` as it ends.
[[nodiscard]] std::vector<PatternRuns> run_settings(const std::vector<PatternSetting>& settings,
                                                    int runs, std::uint64_t first_seed,
                                                    std::ostream& progress);

// Prints the statistics; what is missed is added to *missed, a line each.
void judge_pattern_runs(const std::vector<PatternRuns>& all, std::ostream& out,
                        std::vector<std::string>* missed);

// Every run: setting, seed, error and stated sigma of the nine parameters, CPU time.
void write_pattern_runs(const std::vector<PatternRuns>& all, std::uint64_t first_seed,
                        std::ostream& csv);

}  // namespace alidade::test
