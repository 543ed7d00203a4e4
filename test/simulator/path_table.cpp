#include "test/simulator/path_table.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "test/simulator/config.h"

namespace alidade::simulator {
namespace {

std::vector<std::string> split(const std::string& line) {
  std::vector<std::string> cells;
  std::stringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) {
    while (!cell.empty() && (cell.back() == '\r' || cell.back() == ' ')) cell.pop_back();
    cells.push_back(cell);
  }
  return cells;
}

// "a, b and c"
std::string joined(const std::vector<std::string>& names) {
  std::string text = names.front();
  for (std::size_t i = 1; i < names.size(); ++i) {
    text += (i + 1 < names.size() ? ", " : " and ") + names[i];
  }
  return text;
}

}  // namespace

std::vector<std::vector<double>> read_path_table(const std::filesystem::path& file,
                                                 const std::vector<std::string>& wanted) {
  std::ifstream stream(file);
  std::string line;
  if (!std::getline(stream, line)) throw ConfigError(file.string() + ": cannot be read");
  const std::vector<std::string> names = split(line);
  std::vector<std::size_t> columns;
  for (const std::string& name : wanted) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found == names.end()) {
      throw ConfigError(file.string() + ":1: column " + name + " is missing");
    }
    columns.push_back(static_cast<std::size_t>(found - names.begin()));
  }
  std::vector<std::vector<double>> rows;
  for (int number = 2; std::getline(stream, line); ++number) {
    const std::string where = file.string() + ":" + std::to_string(number);
    const std::vector<std::string> cells = split(line);
    std::vector<double> row;
    for (const std::size_t column : columns) {
      char* end = nullptr;
      const std::string cell = column < cells.size() ? cells[column] : "";
      row.push_back(std::strtod(cell.c_str(), &end));
      if (cell.empty() || *end != '\0' || !std::isfinite(row.back())) {
        throw ConfigError(where + ": a path needs a number in " + joined(wanted));
      }
    }
    if (!rows.empty() && row.front() <= rows.back().front()) {
      throw ConfigError(where + ": " + wanted.front() + " must increase");
    }
    rows.push_back(row);
  }
  if (rows.size() < 2) throw ConfigError(file.string() + ": a path needs two points or more");
  return rows;
}

}  // namespace alidade::simulator
