#include "test/accuracy/report.h"

#include <ostream>

namespace alidade::test {

void Report::add(const Table& table) {
  table.print(out_);
  tables_.push_back(table.to_json());
}

void Report::add_runs(const std::string& name, const std::vector<Run>& runs) {
  for (const Run& run : runs) runs_[name].push_back(run.to_json());
}

void Report::list_failures(const std::string& name, const std::vector<Run>& runs) {
  int failures = 0;
  for (const Run& run : runs) {
    if (run.published() && !run.wrong()) continue;
    ++failures;
    out_ << "  " << name << ", " << run.describe_failure() << "\n";
    fail(name + ": " + run.describe_failure());
  }
  if (failures == 0) {
    out_ << name << ": " << runs.size() << " runs, none refused, none wrong, none dropped\n";
  } else {
    out_ << name << ": " << failures << " of " << runs.size() << " runs refused or wrong\n";
  }
  out_.flush();
}

nlohmann::json Report::to_json() const {
  return {{"tables", tables_}, {"runs", runs_}, {"missed", missed_}};
}

}  // namespace alidade::test
