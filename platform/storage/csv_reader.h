#pragma once
// Reads a table of numbers from a CSV text.
//
// The first line names the columns, in any order. Ignored: unknown columns, empty lines, blanks
// around a cell, a carriage return before the line feed, and a byte order mark. An optional column
// may be missing or have empty cells. Numbers are read by strtod and must be finite. There is no
// quoting. Every line must end with a line feed, so that a file cut off in the middle of a number
// is rejected.

#include <functional>
#include <istream>
#include <optional>
#include <string>
#include <vector>

namespace alidade {

struct CsvColumn {
  const char* name;
  bool required;
  bool whole_numbers;
};

// One cell for each requested column, in the order of the request.
using CsvCells = std::vector<std::optional<double>>;

// Returns what is wrong with a row; empty if it is valid.
using AddCsvRow = std::function<std::string(const CsvCells&)>;

// Calls add_row for each row. On false, *error is one line with the name, the line number and what
// would be right. name stands for the file in errors.
[[nodiscard]] bool parse_csv(std::istream& text, const std::string& name,
                             const std::vector<CsvColumn>& columns, const AddCsvRow& add_row,
                             std::string* error);

[[nodiscard]] bool read_csv(const std::string& path, const std::vector<CsvColumn>& columns,
                            const AddCsvRow& add_row, std::string* error);

}  // namespace alidade
