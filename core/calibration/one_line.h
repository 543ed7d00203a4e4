#pragma once
// An error as one line of a bearable length, whatever the file it tells of holds: control characters,
// which a terminal would obey, become '?'. What is beyond ASCII stays.

#include <algorithm>
#include <cstddef>
#include <string>

namespace alidade {

[[nodiscard]] inline std::string one_line(std::string text) {
  constexpr std::size_t kLongest = 1000;  // bytes
  std::replace_if(
      text.begin(), text.end(),
      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }, '?');
  return text.size() <= kLongest ? text : text.substr(0, kLongest) + "...";
}

}  // namespace alidade
