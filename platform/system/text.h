#pragma once
// Small text functions: trim, parse a number, count things.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <optional>
#include <string>
#include <string_view>

namespace alidade {

// text without leading and trailing characters of `blanks`.
[[nodiscard]] inline std::string_view trimmed(std::string_view text, std::string_view blanks) {
  const std::size_t first = text.find_first_not_of(blanks);
  return first == std::string_view::npos
             ? std::string_view()
             : text.substr(first, text.find_last_not_of(blanks) - first + 1);
}

// Without the blanks around it.
[[nodiscard]] inline std::string_view first_line(std::string_view text) {
  return trimmed(text.substr(0, text.find('\n')), " \t\r");
}

// Parses as strtod does. nullopt if text as a whole is not a number, or not a finite one.
[[nodiscard]] inline std::optional<double> parse_number(std::string_view text) {
  const std::string copy(text);  // strtod needs the terminating null
  char* end = nullptr;
  const double value = std::strtod(copy.c_str(), &end);
  return end != copy.c_str() && *end == '\0' && std::isfinite(value) ? std::optional(value)
                                                                     : std::nullopt;
}

// `1 frame`, `2 frames`.
[[nodiscard]] inline std::string counted(std::int64_t number, std::string_view thing) {
  return std::to_string(number) + " " + std::string(thing) + (number == 1 ? "" : "s");
}

}  // namespace alidade
