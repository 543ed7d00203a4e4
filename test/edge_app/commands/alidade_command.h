#pragma once
// The built executable run to its end, and the tables that it writes.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "test/support/process.h"

namespace alidade {

struct Result {
  int exit_code;
  std::string output;
  std::string errors;
};

inline std::vector<std::string> command(const std::vector<std::string>& arguments) {
  std::vector<std::string> all = {ALIDADE_EXECUTABLE};
  all.insert(all.end(), arguments.begin(), arguments.end());
  return all;
}

inline Result run(const std::vector<std::string>& program_and_arguments) {
  Process process(program_and_arguments);
  std::string output = process.read_all();
  const int exit_code = process.wait();
  return {exit_code, std::move(output), process.errors()};
}

inline Result alidade(const std::vector<std::string>& arguments) { return run(command(arguments)); }

inline Result calibrate_command(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "calibrate");
  return alidade(arguments);
}

// The line that says why, after the log.
inline std::string last_line(const std::string& text) {
  const std::size_t begin = text.rfind('\n', text.size() - 2);
  return begin == std::string::npos ? text : text.substr(begin + 1);
}

// Rows of a CSV table by the names of its columns.
inline std::vector<std::map<std::string, std::string>> read_csv(const std::string& text) {
  const auto split = [](const std::string& line) {
    std::vector<std::string> cells;
    std::istringstream stream(line + ",");
    for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
    return cells;
  };
  std::istringstream stream(text);
  std::string line;
  std::getline(stream, line);
  const std::vector<std::string> names = split(line);
  std::vector<std::map<std::string, std::string>> rows;
  while (std::getline(stream, line)) {
    const std::vector<std::string> cells = split(line);
    EXPECT_EQ(cells.size(), names.size()) << line;
    std::map<std::string, std::string> row;
    for (std::size_t i = 0; i < std::min(cells.size(), names.size()); ++i) row[names[i]] = cells[i];
    rows.push_back(row);
  }
  return rows;
}

}  // namespace alidade
