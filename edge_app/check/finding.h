#pragma once
// What a check says of a link: measured numbers are for the report, a finding is something to do.
//   problem  run would refuse, stop, or answer wrongly or much worse than it could: exit code 1
//   advice   works, and would work better
// One line: what is wrong, where, what would be right. The rules stand with their reasons beside the code that
// applies them.

#include <string>
#include <utility>
#include <vector>

namespace alidade {

enum class Severity { kAdvice, kProblem };

struct Finding {
  Severity severity = Severity::kProblem;
  std::string text;
};

using Findings = std::vector<Finding>;

// For a person: label and text.
using ReportLines = std::vector<std::pair<std::string, std::string>>;

inline void add_problem(Findings* findings, std::string text) {
  findings->push_back({Severity::kProblem, std::move(text)});
}
inline void add_advice(Findings* findings, std::string text) {
  findings->push_back({Severity::kAdvice, std::move(text)});
}

}  // namespace alidade
