#pragma once
// A table as text that a person can read, and as JSON. The first column is set flush left.

#include <nlohmann/json_fwd.hpp>
#include <ostream>
#include <string>
#include <vector>

namespace alidade::test {

struct Table {
  std::string title;
  std::vector<std::string> header;
  std::vector<std::vector<std::string>> rows;
  std::vector<std::string> notes;

  void print(std::ostream& out) const;
  [[nodiscard]] nlohmann::json to_json() const;
};

// Three significant digits, or as many as asked for; "-" for what is not finite.
[[nodiscard]] std::string number(double value, int digits = 3);

}  // namespace alidade::test
