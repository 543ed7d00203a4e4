#pragma once
// A finding of a check: something to do about a link. (Measured numbers go to the report instead.)
//   problem  run would refuse, stop, or answer wrongly or much worse than it could: exit code 1
//   advice   works, and could work better
// One line: what is wrong, where, what would be right. Each rule and its reason are written next to
// the code that applies it.

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

// Lines of a report for people: label and text.
using ReportLines = std::vector<std::pair<std::string, std::string>>;

inline void add_problem(Findings* findings, std::string text) {
  findings->push_back({Severity::kProblem, std::move(text)});
}
inline void add_advice(Findings* findings, std::string text) {
  findings->push_back({Severity::kAdvice, std::move(text)});
}

}  // namespace alidade
