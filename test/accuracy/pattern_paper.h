#pragma once
// The experiments of the second paper (Oth et al., 2013) on simulated recordings, printed as the paper prints them.

#include <cstdint>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

#include "test/accuracy/pattern_monte_carlo.h"

namespace alidade::test {

// Tables 1 and 2: line delays at the pixel clocks, from the runs of those settings that have one, beside Geyer's method with a
// flashing light, simulated; and the line through them. Slope beyond 1650.0 +- 0.5, more with less than 40 runs each:
// added to *missed.
void print_line_delays(const std::vector<PatternRuns>& all, std::uint64_t first_seed,
                       std::ostream& out, std::vector<std::string>* missed);

// Table 3: three cameras like the paper's telephones before grids of circles, as often as there; share: of these runs.
void print_telephones(double share, std::uint64_t first_seed, std::ostream& out);

// Figure 4: one recording with uniform knots, from too few to too many, and with the automatic choice; figure4.csv and
// figure4.svg into the folder.
void print_uniform_knots(std::uint64_t seed, const std::filesystem::path& folder,
                         std::ostream& out);

// Figure 5: where the camera is, by a curve that knows the line delay, and frame by frame as if all rows were exposed at once;
// figure5.csv into the folder.
void print_localization(std::uint64_t seed, const std::filesystem::path& folder, std::ostream& out);

// The residual's covariance (Oth 15 to 21): left out, as derived from the model, and as printed, beside the row that the model
// predicts, which needs none.
void print_standardisation(int recordings, std::uint64_t first_seed, std::ostream& out);

}  // namespace alidade::test
