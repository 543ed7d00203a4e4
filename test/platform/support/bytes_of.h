#pragma once

#include <initializer_list>
#include <string>

namespace alidade {

// Of numbers 0 to 255, as manuals of protocols write them.
inline std::string bytes_of(std::initializer_list<int> values) {
  std::string bytes;
  for (const int value : values) bytes += static_cast<char>(value);
  return bytes;
}

}  // namespace alidade
