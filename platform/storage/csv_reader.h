#pragma once
// Reads a table of numbers from a CSV text.
//
// The first line names the columns, in any order; unknown ones are ignored, as are empty lines, blanks
// around a cell, a carriage return before the line feed and a byte order mark. An optional column may be
// missing, or have empty cells. Numbers are read by strtod and must be finite; nothing is quoted. Every
// line must end with a line feed: a file cut off in the middle of a number must not pass.

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

// One for each column, in the order in which they were asked for.
using CsvCells = std::vector<std::optional<double>>;

// What is wrong with a row; empty: nothing.
using AddCsvRow = std::function<std::string(const CsvCells&)>;

// Calls add_row for each row. False: *error is one line with name, line, and what would be right. name
// stands for the file.
[[nodiscard]] bool parse_csv(std::istream& text, const std::string& name,
                             const std::vector<CsvColumn>& columns, const AddCsvRow& add_row,
                             std::string* error);

[[nodiscard]] bool read_csv(const std::string& path, const std::vector<CsvColumn>& columns,
                            const AddCsvRow& add_row, std::string* error);

}  // namespace alidade
