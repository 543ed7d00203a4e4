#include "platform/system/random.h"

#include <sys/random.h>

#include <algorithm>
#include <cerrno>
#include <system_error>

namespace alidade {

std::string random_bytes(std::size_t count) {
  constexpr std::size_t kAtOnce = 256;  // getrandom(2) always delivers as many as that
  std::string bytes(std::min(count, kAtOnce), '\0');
  while (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    if (errno != EINTR) throw std::system_error(errno, std::generic_category(), "getrandom");
  }
  return bytes;
}

std::string random_hex(std::size_t digits) {
  std::string text;
  for (const char byte : random_bytes((digits + 1) / 2)) {
    const auto value = static_cast<unsigned char>(byte);
    text += "0123456789abcdef"[value >> 4U];
    text += "0123456789abcdef"[value & 15U];
  }
  text.resize(std::min(digits, text.size()));
  return text;
}

}  // namespace alidade
