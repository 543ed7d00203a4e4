#pragma once
// How many file descriptors this process holds open.

#include <cstddef>
#include <filesystem>
#include <iterator>

namespace alidade {

inline std::ptrdiff_t open_files() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"),
                       std::filesystem::directory_iterator());
}

}  // namespace alidade
