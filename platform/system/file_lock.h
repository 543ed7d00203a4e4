#pragma once
// FileLock: what is kept under a path belongs to one process at a time. A lock of the kernel's on PATH.lock, which holds
// the number and the command of who has it and stays there, unless it is removed by who made it: the lock itself ends with its process,
// whatever ended that. Processes of other hosts are kept out where the network file system has locks. Advisory: who only reads needs none.

#include <string>

#include "platform/system/file_descriptor.h"

namespace alidade {

class FileLock {
 public:
  enum class Result {
    kTaken,
    kInUse,  // by another
    kImpossible  // there can be no lock here: a folder that cannot be written, a file system without locks
  };

  // Waits for nobody. What is not taken leaves one line in *why.
  [[nodiscard]] Result take(const std::string& path, std::string* why);
  void release() { file_.reset(); }
  // So, and takes PATH.lock away if this object made it.
  void release_and_remove();
  // PATH.lock, if this object made it.
  [[nodiscard]] const std::string& made() const { return made_; }

 private:
  FileDescriptor file_;
  std::string made_;
};

}  // namespace alidade
