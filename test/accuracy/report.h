#pragma once
// What an experiment hands back: tables printed as they come, all of it as JSON in the end, and whether
// every statistic lies where an efficient and honest estimator's would.

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "test/accuracy/run.h"
#include "test/accuracy/table.h"

namespace alidade::test {

class Report {
 public:
  explicit Report(std::ostream& out) : out_(out) {}

  void add(const Table& table);
  void add_runs(const std::string& name, const std::vector<Run>& runs);
  // One line each for every refused or wrong run, and for there being none.
  void list_failures(const std::string& name, const std::vector<Run>& runs);
  void fail(const std::string& what) { missed_.push_back(what); }

  [[nodiscard]] const std::vector<std::string>& missed() const { return missed_; }
  [[nodiscard]] nlohmann::json to_json() const;

 private:
  std::ostream& out_;
  std::vector<std::string> missed_;
  nlohmann::json tables_ = nlohmann::json::array();
  nlohmann::json runs_ = nlohmann::json::object();
};

// The intervals that are printed; one statistic in twenty lies outside its own by chance.
inline constexpr double kPrintedProbability = 0.95;
// A verdict is on all statistics together: by chance, one experiment in a hundred misses.
inline constexpr double kVerdictProbability = 0.99;

}  // namespace alidade::test
