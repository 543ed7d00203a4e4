#include "platform/storage/csv_reader.h"

#include <ext/stdio_filebuf.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <istream>
#include <string_view>

#include "platform/system/shown.h"
#include "platform/system/text.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

constexpr std::string_view kSpaces = " \t";

constexpr std::size_t kLongestCsvLine = 65536;  // bytes

// Reads a line without its line feed. False at the end of the text. *cut_off: the last line has no
// line feed. Of a line that is too long, only the start is read, longer than kLongestCsvLine.
bool next_line(std::istream& text, std::string* line, bool* cut_off) {
  line->clear();
  for (char piece[4096]; line->size() <= kLongestCsvLine;) {
    text.getline(piece, sizeof piece);
    const auto size = static_cast<std::size_t>(text.gcount());
    const bool goes_on = text.fail() && !text.eof() && !text.bad() && size == sizeof piece - 1;
    const bool has_end = !goes_on && !text.eof() && !text.fail();
    line->append(piece, has_end ? size - 1 : size);
    if (!goes_on) break;
    text.clear();
  }
  if (text.bad() || (text.fail() && line->empty())) {
    return false;
  }
  *cut_off = text.eof();
  if (!line->empty() && line->back() == '\r') {
    line->pop_back();
  }
  return true;
}

void split(std::string_view line, std::vector<std::string_view>* cells) {
  cells->clear();
  for (std::size_t begin = 0; begin <= line.size();) {
    const std::size_t end = std::min(line.find(',', begin), line.size());
    cells->push_back(trimmed(line.substr(begin, end - begin), kSpaces));
    begin = end + 1;
  }
}

// Empty if the text is valid for the column, else what is wrong. `buffer` is memory for reuse.
std::string parse_cell(const CsvColumn& column, std::string_view text, std::string* buffer,
                       std::optional<double>* value) {
  value->reset();
  if (!column.required && text.empty()) {
    return {};
  }
  buffer->assign(text);  // strtod needs the terminating null
  char* end = nullptr;
  const double number = std::strtod(buffer->c_str(), &end);
  const char* kind = column.whole_numbers ? "a whole number" : "a number";
  if (text.empty() || end != buffer->c_str() + buffer->size() || !std::isfinite(number) ||
      (column.whole_numbers && (number != std::floor(number) || std::abs(number) > 0x1p53))) {
    return "'" + shown(text) + "' in column " + column.name + " is not " + kind;
  }
  *value = number;
  return {};
}

// Finds the table's columns in its first line. *places is nullopt for a missing one. Returns "" or
// what is wrong.
std::string find_columns(const std::vector<CsvColumn>& columns,
                         const std::vector<std::string_view>& names,
                         std::vector<std::optional<std::size_t>>* places) {
  for (const CsvColumn& column : columns) {
    const auto found = std::find(names.begin(), names.end(), column.name);
    places->emplace_back();
    if (found != names.end()) {
      places->back() = static_cast<std::size_t>(found - names.begin());
      if (std::find(found + 1, names.end(), column.name) != names.end()) {
        return std::string("column '") + column.name + "' is given twice";
      }
    } else if (column.required) {
      return std::string("no column '") + column.name + "'";
    }
  }
  return {};
}

}  // namespace

bool parse_csv(std::istream& text, const std::string& name, const std::vector<CsvColumn>& columns,
               const AddCsvRow& add_row, std::string* error) {
  std::string expected;
  for (const CsvColumn& column : columns) {
    const std::string known = (expected.empty() ? "" : ",") + std::string(column.name);
    expected += column.required ? known : "[" + known + "]";
  }
  std::string line;
  std::string buffer;
  std::vector<std::string_view> texts;
  std::vector<std::optional<std::size_t>> places;
  CsvCells cells(columns.size());
  std::size_t number = 0;  // of the line
  std::size_t width = 0;   // cells of the first line
  for (bool cut_off = false; next_line(text, &line, &cut_off);) {
    ++number;
    const auto malformed = [&](const std::string& what) {
      *error = name + ":" + std::to_string(number) + ": ";
      error->append(what).append("; the columns are ").append(expected);
      return false;
    };
    if (line.size() > kLongestCsvLine) {
      return malformed("a line of more than " + std::to_string(kLongestCsvLine) + " bytes");
    }
    if (cut_off) {
      *error = name + ":" + std::to_string(number) +
               ": the file is cut off: its last line does not end with a newline; delete that "
               "line, or complete it";
      return false;
    }
    constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";
    if (number == 1 && line.compare(0, kByteOrderMark.size(), kByteOrderMark) == 0) {
      line.erase(0, kByteOrderMark.size());
    }
    if (trimmed(line, kSpaces).empty()) {
      continue;
    }
    split(line, &texts);
    std::string flaw;
    if (width == 0) {
      width = texts.size();
      flaw = find_columns(columns, texts, &places);
    } else if (texts.size() != width) {
      flaw = texts.size() < width ? "fewer cells than the header has"
                                  : "more cells than the header has";
    } else {
      for (std::size_t i = 0; i < columns.size() && flaw.empty(); ++i) {
        flaw = parse_cell(columns[i], places[i] ? texts[*places[i]] : std::string_view(), &buffer,
                          &cells[i]);
      }
      flaw = flaw.empty() ? add_row(cells) : flaw;
    }
    if (!flaw.empty()) {
      return malformed(flaw);
    }
  }
  if (text.bad()) {
    *error = name + ": " + std::strerror(errno);
    return false;
  }
  if (width == 0) {
    *error = name + ":1: no header line; the columns are " + expected;
    return false;
  }
  return true;
}

bool read_csv(const std::string& path, const std::vector<CsvColumn>& columns,
              const AddCsvRow& add_row, std::string* error) {
  FileDescriptor file = open_to_read(path, error);
  if (!file.is_open()) {
    return false;
  }
  errno = 0;
  __gnu_cxx::stdio_filebuf<char> buffer(file.release(), std::ios::in | std::ios::binary);
  std::istream text(&buffer);
  return parse_csv(text, path, columns, add_row, error);
}

}  // namespace alidade
