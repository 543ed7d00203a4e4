#pragma once
// What programs share that calibrate from rendered recordings, one after another.

#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "test/accuracy/table.h"

namespace alidade::test {

struct RecordingRange {
  int from = 0;
  int recordings = 0;
  std::filesystem::path folder;
};

inline void add_options(CLI::App* app, RecordingRange* range) {
  app->add_option("--from", range->from, "Number of the first")->check(CLI::Range(0, 10000));
  app->add_option("--recordings", range->recordings, "How many")->check(CLI::Range(1, 10000));
  app->add_option("--folder", range->folder, "Where they are written, one at a time")
      ->capture_default_str();
}

// They take minutes: whoever looks sees how far it is.
inline void show(const std::vector<std::string>& row) {
  for (const std::string& cell : row) std::cout << cell << "  ";
  std::cout << std::endl;
}

// The exit status: 0, or 1 with what is missed.
inline int conclude(const Table& each, const Table& all, const std::vector<std::string>& missed) {
  each.print(std::cout);
  all.print(std::cout);
  for (const std::string& what : missed) std::cout << "MISSED: " << what << "\n";
  return missed.empty() ? 0 : 1;
}

}  // namespace alidade::test
