#pragma once
// Whole files. One that is written appears whole or not at all: written beside its place, brought to the disk,
// renamed. A reader, or a power cut, meets the old file or the new one, never half of one. No shared state.
// Meanwhile it is called NAME.unfinished-XXXXXX, and locked: one that is not is of a process that was killed.
// What is read is a file, whatever a user or somebody else put under its name: no pipe, device or folder, which would be waited for
// or have no end, and nothing larger than its kind can be.

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "platform/system/file_descriptor.h"

namespace alidade {

// Removes what killed processes left of it. False leaves what was there, no remains, and `path: cannot be written: why` in *error.
[[nodiscard]] bool write_file_atomically(const std::string& path, const std::string& content,
                                         std::string* error);

// The same of a file that somebody else wrote beside its place.
[[nodiscard]] bool move_into_place(const std::string& from, const std::string& to,
                                   std::string* error);

// Removes what killed processes left unfinished in a folder of files whose names are ours. Says how many.
int remove_unfinished(const std::string& folder,
                      const std::function<bool(const std::string& name)>& is_ours);

// What an open file takes, however many calls that needs. False leaves the reason in errno.
[[nodiscard]] bool write_all(int descriptor, std::string_view bytes);

// A closed one leaves `path: cannot be read: why` in *error. Waits for nobody.
[[nodiscard]] FileDescriptor open_to_read(const std::string& path, std::string* error);

// Of what people write, and of what is written for them to read: YAML, passwords, labels.
inline constexpr std::size_t kMostTextBytes = std::size_t{4} << 20;

// False leaves `path: cannot be read: why` in *error.
[[nodiscard]] bool read_file(const std::string& path, std::string* content, std::string* error,
                             std::size_t most_bytes = kMostTextBytes);

}  // namespace alidade
