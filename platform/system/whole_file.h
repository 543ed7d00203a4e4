#pragma once
// Whole files. One that is written appears whole or not at all: written beside its place, brought to the disk,
// renamed. A reader, or a power cut, meets the old file or the new one, never half of one. No shared state.

#include <string>

namespace alidade {

// False leaves what was there, no remains, and `path: cannot be written: why` in *error.
[[nodiscard]] bool write_file_atomically(const std::string& path, const std::string& content,
                                         std::string* error);

// The same of a file that somebody else wrote beside its place.
[[nodiscard]] bool move_into_place(const std::string& from, const std::string& to,
                                   std::string* error);

// False leaves `path: cannot be read: why` in *error.
[[nodiscard]] bool read_file(const std::string& path, std::string* content, std::string* error);

}  // namespace alidade
