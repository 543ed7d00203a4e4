#pragma once
// Foreign text and numbers for error messages: short, on one line, without anything that a terminal
// would obey.

#include <cstddef>
#include <cstdio>
#include <string>
#include <string_view>

#include "platform/system/escaped.h"

namespace alidade {

// The first `most` bytes, cut between UTF-8 characters, then escaped (so it may become longer).
[[nodiscard]] inline std::string shown(std::string_view text, std::size_t most = 80) {
  const auto is_inside = [&](std::size_t at) {
    return (static_cast<unsigned char>(text[at]) & 0xC0U) == 0x80U;
  };
  if (text.size() > most) {
    std::size_t end = most;
    while (end > 0 && most - end < 3 && is_inside(end)) --end;
    text = text.substr(0, is_inside(end) ? most : end);
  }
  return escaped(text);
}

// Nine digits: a forged 1e300 is not printed with three hundred.
[[nodiscard]] inline std::string shown(double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.9g", number);
  return text;
}

}  // namespace alidade
