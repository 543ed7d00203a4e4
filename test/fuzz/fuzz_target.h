#pragma once
// What all fuzz targets share. A target is one file that defines LLVMFuzzerTestOneInput() and states
// what must hold of a parser for any bytes at all; FUZZ_REQUIRE() ends the process where it does not.
// The same file is linked with libFuzzer (preset fuzz), which looks for new ways through the parser,
// and with regression_driver.cpp (all other builds), which runs what is committed.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

// As an assertion, but in every build.
#define FUZZ_REQUIRE(condition)                                                           \
  do {                                                                                    \
    if (!(condition)) {                                                                   \
      std::fprintf(stderr, "%s:%d: does not hold: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                       \
    }                                                                                     \
  } while (false)

namespace alidade {

inline std::string_view text_of(const std::uint8_t* data, std::size_t size) {
  return {reinterpret_cast<const char*>(data), size};
}

// What a user is told: something, on one line, with nothing in it that a terminal would obey.
inline bool is_one_line(std::string_view text) {
  return !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return static_cast<unsigned char>(c) >= 0x20 && c != 0x7F;
  });
}

// Bytes of an error that shows so much foreign text (platform/system/shown.h), each byte of it as
// an escape of four at worst, beside words of its own.
constexpr std::size_t longest_error(std::size_t words, std::size_t foreign = 80) {
  return words + 4 * foreign;
}

// Takes an input apart from its front; zeros where it is over.
class FuzzInput {
 public:
  FuzzInput(const std::uint8_t* data, std::size_t size) : rest_(text_of(data, size)) {}

  [[nodiscard]] bool empty() const { return rest_.empty(); }
  [[nodiscard]] std::string_view rest() const { return rest_; }

  std::uint8_t byte() {
    const std::string_view taken = bytes(1);
    return taken.empty() ? std::uint8_t{0} : static_cast<std::uint8_t>(taken[0]);
  }
  std::string_view bytes(std::size_t count) {
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(taken.size());
    return taken;
  }
  // Any double at all.
  double number() {
    double value = 0;
    const std::string_view taken = bytes(sizeof value);
    std::memcpy(&value, taken.data(), taken.size());
    return value;
  }
  // Up to and without the next line feed.
  std::string_view line() {
    const std::string_view taken = bytes(rest_.find('\n'));
    bytes(1);
    return taken;
  }

 private:
  std::string_view rest_;
};

}  // namespace alidade
