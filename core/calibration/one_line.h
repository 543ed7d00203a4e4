#pragma once
// An error as one line of at most 1000 bytes, whatever file the error quotes. A longer text is cut
// between two UTF-8 characters and ends in "...". ASCII's control characters, which a terminal
// would obey, become '?'. Other characters stay.

#include <algorithm>
#include <cstddef>
#include <string>

namespace alidade {

[[nodiscard]] inline std::string one_line(std::string text) {
  constexpr std::size_t kLongest = 1000;  // bytes
  constexpr std::size_t kLongestUtf8 = 4;
  std::replace_if(
      text.begin(), text.end(),
      [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; }, '?');
  if (text.size() <= kLongest) return text;
  const std::size_t most = kLongest - 3;
  std::size_t end = most;
  const auto is_inside = [&] { return (static_cast<unsigned char>(text[end]) & 0xC0U) == 0x80U; };
  while (most - end < kLongestUtf8 && is_inside()) --end;
  text.resize(is_inside() ? most : end);  // not UTF-8: no place is better than another
  return text + "...";
}

}  // namespace alidade
