#pragma once
// The texts of a check's findings, by how much they matter.

#include <string>
#include <vector>

#include "edge_app/check/finding.h"

namespace alidade {

inline std::vector<std::string> texts(const Findings& findings, Severity severity) {
  std::vector<std::string> texts;
  for (const Finding& finding : findings) {
    if (finding.severity == severity) texts.push_back(finding.text);
  }
  return texts;
}
inline std::vector<std::string> problems(const Findings& findings) {
  return texts(findings, Severity::kProblem);
}
inline std::vector<std::string> advice(const Findings& findings) {
  return texts(findings, Severity::kAdvice);
}

}  // namespace alidade
