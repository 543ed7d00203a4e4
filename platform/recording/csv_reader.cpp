#include "platform/recording/csv_reader.h"

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>

namespace alidade {

bool check_csv_file(const std::string& path, std::string* error) {
  errno = 0;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) {
    *error = path + ": " + std::strerror(errno);
    return false;
  }
  char last = '\n';
  if (file.tellg() > 0) {
    file.seekg(-1, std::ios::end);
    file.get(last);
  }
  if (!file || last != '\n') {
    *error = path +
             ": the file is cut off: its last line does not end with a newline; delete that " +
             "line, or complete it";
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
