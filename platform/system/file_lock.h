#pragma once
// FileLock: what is kept under a path belongs to one process at a time. A lock of the kernel's on PATH.lock, which stays there and holds
// the number and the command of who has it: it ends with its process, whatever ended that, and none is ever left behind. Processes of
// other hosts are kept out where the network file system has locks. Advisory: who only reads needs none.

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

 private:
  FileDescriptor file_;
};

}  // namespace alidade
