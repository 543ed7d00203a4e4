#include "platform/system/escaped.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstdio>

namespace alidade {
namespace {

// Length of a UTF-8 character by its first byte; 0: not a valid first byte.
std::size_t length_of(unsigned char first) {
  if (first < 0x80) return 1;
  if (first >= 0xC2 && first <= 0xDF) return 2;
  if (first >= 0xE0 && first <= 0xEF) return 3;
  return first >= 0xF0 && first <= 0xF4 ? 4 : 0;
}

struct Character {
  std::uint32_t code = 0;
  std::size_t length = 0;  // bytes; 0: not valid UTF-8
};

Character first_of(std::string_view text) {
  const auto first = static_cast<unsigned char>(text[0]);
  const std::size_t length = length_of(first);
  if (length == 0 || length > text.size()) return {};
  constexpr std::array<std::uint32_t, 5> kOfFirst = {0, 0x7F, 0x1F, 0x0F, 0x07};
  std::uint32_t code = first & kOfFirst[length];
  for (std::size_t i = 1; i < length; ++i) {
    const auto next = static_cast<unsigned char>(text[i]);
    if ((next & 0xC0U) != 0x80U) return {};
    code = (code << 6U) | (next & 0x3FU);
  }
  // Overlong, half of a surrogate pair, or beyond the last code point.
  constexpr std::array<std::uint32_t, 5> kLeast = {0, 0, 0x80, 0x800, 0x10000};
  const bool wrong = code < kLeast[length] || (code >= 0xD800 && code <= 0xDFFF) || code > 0x10FFFF;
  return wrong ? Character() : Character{code, length};
}

bool is_obeyed(std::uint32_t code) {
  return code < 0x20 || (code >= 0x7F && code <= 0x9F) || code == 0x61C ||
         (code >= 0x200E && code <= 0x200F) || (code >= 0x2028 && code <= 0x202E) ||
         (code >= 0x2066 && code <= 0x2069);
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const Character character = first_of(text);
    char escape[8] = "";
    if (character.length == 0) {
      std::snprintf(escape, sizeof escape, "\\x%02x",
                    static_cast<unsigned>(static_cast<unsigned char>(text[0])));
    } else if (character.code == '\n' || character.code == '\r' || character.code == '\t') {
      std::snprintf(escape, sizeof escape, "\\%c",
                    character.code == '\n' ? 'n' : (character.code == '\r' ? 'r' : 't'));
    } else if (is_obeyed(character.code)) {
      std::snprintf(escape, sizeof escape, character.code < 0x80 ? "\\x%02x" : "\\u%04x",
                    static_cast<unsigned>(character.code));
    }
    const std::size_t length = character.length == 0 ? 1 : character.length;
    out.append(escape[0] != '\0' ? std::string_view(escape) : text.substr(0, length));
    text.remove_prefix(length);
  }
  return out;
}

}  // namespace alidade
