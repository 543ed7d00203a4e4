#pragma once
// Reads a table of numbers from a CSV text.
//
// The first line names the columns, in any order, each once. Ignored: unknown columns, empty lines,
// spaces and tabs around a cell, a carriage return before the line feed, and a byte order mark. A
// row has as many cells as the first line. An optional column may be missing or have empty cells.
// Numbers are read by strtod and must be finite. There is no quoting. Every line must end with a
// line feed, so that a file cut off in the middle of a number is rejected; so is one with a line of
// more than 64 KiB.

#include <functional>
#include <istream>
#include <optional>
#include <string>
#include <vector>

namespace alidade {

struct CsvColumn {
  const char* name;
  bool required;       // the column must be there, and none of its cells empty
  bool whole_numbers;  // its numbers must be whole, at most 2^53 in magnitude
};

// One cell for each requested column, in the order of the request.
using CsvCells = std::vector<std::optional<double>>;

// Returns what is wrong with a row; empty if it is valid.
using AddCsvRow = std::function<std::string(const CsvCells&)>;

// Calls add_row for each row, up to the first fault. On false, *error is one line with the name,
// the line number and what would be right. name stands for the file in errors.
[[nodiscard]] bool parse_csv(std::istream& text, const std::string& name,
                             const std::vector<CsvColumn>& columns, const AddCsvRow& add_row,
                             std::string* error);

// The same of a regular file.
[[nodiscard]] bool read_csv(const std::string& path, const std::vector<CsvColumn>& columns,
                            const AddCsvRow& add_row, std::string* error);

}  // namespace alidade
