#pragma once
// Random bytes of the kernel, for nonces, tokens and names that must not be guessed. Any thread.
// Both throw std::system_error if a filter of system calls forbids getrandom(2).

#include <cstddef>
#include <string>

namespace alidade {

// count: 0 to 256 (more: 256). Waits, at the very start of the machine only, until the kernel has
// gathered enough.
[[nodiscard]] std::string random_bytes(std::size_t count);

// Random hexadecimal digits, in lower case. digits: their number, 0 to 512 (more: 512).
[[nodiscard]] std::string random_hex(std::size_t digits);

}  // namespace alidade
