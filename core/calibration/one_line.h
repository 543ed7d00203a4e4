#pragma once
// An error as one line of limited length, whatever the file it quotes holds. Control characters,
// which a terminal would obey, become '?'. Characters beyond ASCII stay.

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
