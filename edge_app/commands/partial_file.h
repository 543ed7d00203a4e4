#pragma once
// A file that gets its name only when it is complete. Until complete() it is NAME.partial, which
// the destructor removes.

#include <string>

#include "platform/system/file_descriptor.h"

namespace alidade {

class PartialFile {
 public:
  // Throws CommandError if the file cannot be written; so does complete().
  explicit PartialFile(std::string path);
  ~PartialFile();
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;

  [[nodiscard]] int descriptor() const { return file_.get(); }
  [[nodiscard]] const std::string& path() const { return path_; }
  void complete();

 private:
  const std::string path_;
  const std::string partial_;
  FileDescriptor file_;
};

}  // namespace alidade
