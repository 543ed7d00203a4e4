#pragma once
// The table of a path on disk: a CSV file with a header, of which some columns are wanted, the first of them rising times.

#include <filesystem>
#include <string>
#include <vector>

namespace alidade::simulator {

// The wanted columns of each row, in the order asked for; two rows or more. Throws ConfigError with file and line.
[[nodiscard]] std::vector<std::vector<double>> read_path_table(
    const std::filesystem::path& file, const std::vector<std::string>& wanted);

}  // namespace alidade::simulator
