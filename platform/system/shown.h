#pragma once
// Foreign text and numbers as an error shows them: short, on one line, with nothing that a terminal
// would obey.

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>

namespace alidade {

// The first `most` bytes; '?' for what is not printable ASCII.
[[nodiscard]] inline std::string shown(std::string_view text, std::size_t most = 80) {
  std::string line(text.substr(0, most));
  std::replace_if(
      line.begin(), line.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
  return line;
}

// Nine digits; a forged 1e300 has not three hundred.
[[nodiscard]] inline std::string shown(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", number);
  return text;
}

}  // namespace alidade
