#pragma once
// Whole files. A file is written beside its place, synced to the disk and renamed. A reader, or a
// power cut, finds the old file or the new one, never a part. No shared state. While a file is
// written it is called NAME.unfinished-XXXXXX and is locked; an unlocked file of such a name was
// left by a killed process.
// Reading accepts only regular files, whatever the name refers to: a pipe, device or folder could
// block or have no end. A file larger than its kind can be is refused.

#include <cstddef>
#include <functional>
#include <string>
#include <string_view>

#include "platform/system/file_descriptor.h"

namespace alidade {

// First removes unfinished files that killed processes left of this file. On false the old file
// stays, nothing unfinished is left, and *error is `path: cannot be written: why`. mode: who may
// read and write it.
inline constexpr unsigned kForAllToRead = 0644;
inline constexpr unsigned kForTheOwnerOnly = 0600;
[[nodiscard]] bool write_file_atomically(const std::string& path, const std::string& content,
                                         std::string* error, unsigned mode = kForAllToRead);

// The same last steps for a file that other code wrote beside its place: syncs `from` and renames
// it to `to`. On false both names are as before, and *error is as above.
[[nodiscard]] bool move_into_place(const std::string& from, const std::string& to,
                                   std::string* error);

// Removes unfinished files of killed processes from a folder, if is_ours(NAME). Returns how many.
int remove_unfinished(const std::string& folder,
                      const std::function<bool(const std::string& name)>& is_ours);

// Writes all bytes, with as many calls as needed. On false the reason is in errno.
[[nodiscard]] bool write_all(int descriptor, std::string_view bytes);

// Opens a file for reading. Does not wait. On failure the result is not open, and *error is
// `path: cannot be read: why`.
[[nodiscard]] FileDescriptor open_to_read(const std::string& path, std::string* error);

// For text that people write or read: YAML, passwords, labels.
inline constexpr std::size_t kMostTextBytes = std::size_t{4} << 20;

// On false *error is `path: cannot be read: why`, and *content is unchanged.
[[nodiscard]] bool read_file(const std::string& path, std::string* content, std::string* error,
                             std::size_t most_bytes = kMostTextBytes);

}  // namespace alidade
