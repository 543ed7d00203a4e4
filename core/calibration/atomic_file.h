#pragma once
// A file that appears whole or not at all: written beside its place, brought to the disk, renamed.
// A reader, or a power cut, meets the old file or the new one, never half of one. Allocates nothing
// but names; no shared state.

#include <string>

namespace alidade {

// False leaves what was there, no remains, and `path: cannot be written: why` in *error.
[[nodiscard]] bool write_file_atomically(const std::string& path, const std::string& content,
                                         std::string* error);

}  // namespace alidade
