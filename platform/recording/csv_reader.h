#pragma once
// Reads a table of numbers from a CSV file (fast-cpp-csv-parser finds lines and cells).
//
// The first line names the columns, in any order; unknown ones are ignored, as are empty lines. An
// optional column may be missing, or have empty cells. Numbers are read by strtod and must be finite.
// Every line must end with a newline: a file cut off in the middle of a number must not pass.

#include <array>
#include <cstddef>
#include <limits>  // csv.h needs it and does not include it
#include <optional>
#include <string>
#include <tuple>
#include <utility>

#define CSV_IO_NO_THREAD
#include <libfccp/csv.h>

namespace alidade {

struct CsvColumn {
  const char* name;
  bool required;
  bool whole_numbers;
};

template <std::size_t N>
using CsvCells = std::array<std::optional<double>, N>;

// True if the file can be opened and is not cut off.
[[nodiscard]] bool check_csv_file(const std::string& path, std::string* error);

// "" if the text is what the column holds, else what is wrong. No text: no such column in the file.
[[nodiscard]] std::string parse_csv_cell(const CsvColumn& column, const char* text,
                                         std::optional<double>* value);

// Calls add_row(const CsvCells<N>&) for each row; what it returns, if not empty, is what is wrong with
// the row. False: *error is one line with file, line, and what would be right.
template <std::size_t N, class AddRow>
[[nodiscard]] bool read_csv(const std::string& path, const std::array<CsvColumn, N>& columns,
                            AddRow add_row, std::string* error) {
  if (!check_csv_file(path, error)) {
    return false;
  }
  std::string expected;
  for (const CsvColumn& column : columns) {
    const std::string name = (expected.empty() ? "" : ",") + std::string(column.name);
    expected += column.required ? name : "[" + name + "]";
  }
  std::size_t line = 1;
  const auto malformed = [&](const std::string& what) {
    *error = path + ":" + std::to_string(line) + ": " + what + "; the columns are " + expected;
    return false;
  };
  try {
    io::CSVReader<N, io::trim_chars<' ', '\t'>, io::no_quote_escape<','>, io::throw_on_overflow,
                  io::empty_line_comment>
        reader(path);
    std::apply(
        [&](const auto&... column) {
          reader.read_header(io::ignore_extra_column | io::ignore_missing_column, column.name...);
        },
        columns);
    line = reader.get_file_line();
    for (const CsvColumn& column : columns) {
      if (column.required && !reader.has_column(column.name)) {
        return malformed(std::string("no column '") + column.name + "'");
      }
    }
    std::array<char*, N> texts{};
    while (std::apply([&](auto&... text) { return reader.read_row(text...); }, texts)) {
      line = reader.get_file_line();
      CsvCells<N> cells;
      for (std::size_t i = 0; i < N; ++i) {
        const std::string flaw = parse_csv_cell(columns[i], texts[i], &cells[i]);
        if (!flaw.empty()) {
          return malformed(flaw);
        }
      }
      const std::string flaw = add_row(std::as_const(cells));
      if (!flaw.empty()) {
        return malformed(flaw);
      }
    }
  } catch (const io::error::too_few_columns& flaw) {
    line = static_cast<std::size_t>(flaw.file_line);
    return malformed("fewer cells than the header has");
  } catch (const io::error::too_many_columns& flaw) {
    line = static_cast<std::size_t>(flaw.file_line);
    return malformed("more cells than the header has");
  } catch (const io::error::header_missing&) {
    return malformed("no header line");
  } catch (const io::error::base& flaw) {
    return malformed(flaw.what());
  }
  return true;
}

}  // namespace alidade
