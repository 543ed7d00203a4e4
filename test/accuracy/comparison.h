#pragma once
// Given recordings: our estimate, the truth, another program's estimate and the bound, side by side.

#include <string>

#include "test/accuracy/report.h"

namespace alidade::test {

// All folders below `directory` that hold a recording. False: *error says what is wrong.
[[nodiscard]] bool compare_recordings(const std::string& directory, Report* report,
                                      std::string* error);

}  // namespace alidade::test
