#pragma once
// A file that gets its name only when it is complete. Until then it is NAME.partial; an older
// NAME.partial is overwritten. If complete() was not called, the destructor removes NAME.partial.

#include <string>

#include "platform/system/file_descriptor.h"

namespace alidade {

class PartialFile {
 public:
  // Throws CommandError if the file cannot be written.
  explicit PartialFile(std::string path);
  ~PartialFile();
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  // To write to, until complete().
  [[nodiscard]] int descriptor() const { return file_.get(); }
  // The final name.
  [[nodiscard]] const std::string& path() const { return path_; }
  // Closes the file and renames it; a file of the final name is replaced. Does not wait until the
  // data is on the disk. To be called once. Throws CommandError if the file cannot be renamed.
  void complete();

 private:
  const std::string path_;
  const std::string partial_;
  FileDescriptor file_;
};

}  // namespace alidade
