#include "platform/recording/csv_reader.h"

#include <cerrno>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace alidade {

bool check_csv_file(const std::string& path, std::string* error) {
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) {
    *error = path + ": " + std::strerror(errno);
    return false;
  }
  std::int64_t lines = 0;
  for (std::string line; std::getline(file, line); ++lines) {
    if (!file.eof()) continue;  // it ended with its newline
    *error = path + ":" + std::to_string(lines + 1) +
             ": the file is cut off: its last line does not end with a newline; delete that line, "
             "or complete it";
    return false;
  }
  if (file.bad()) {
    *error = path + ": " + std::strerror(errno);
    return false;
  }
  return true;
}

std::string parse_csv_cell(const CsvColumn& column, const char* text,
                           std::optional<double>* value) {
  if (!column.required && (text == nullptr || *text == '\0')) {
    value->reset();
    return {};
  }
  char* end = nullptr;
  const double number = std::strtod(text, &end);
  const char* kind = column.whole_numbers ? "a whole number" : "a number";
  if (end == text || *end != '\0' || !std::isfinite(number) ||
      (column.whole_numbers && (number != std::floor(number) || std::abs(number) > 0x1p53))) {
    return "'" + std::string(text) + "' in column " + column.name + " is not " + kind;
  }
  *value = number;
  return {};
}

}  // namespace alidade
