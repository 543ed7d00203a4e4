#pragma once
// FileLock: reserves what is stored under PATH for one process, by a kernel lock (flock) on
// PATH.lock. This file holds the process number and command of the owner. The lock ends with the
// owner, even if the owner is killed; the file PATH.lock stays unless its creator removes it.
// Processes on other hosts are excluded if the network file system supports locks. Advisory:
// readers need no lock.

#include <string>

#include "platform/system/file_descriptor.h"

namespace alidade {

class FileLock {
 public:
  enum class Result {
    kTaken,
    kInUse,      // by another process, or by another FileLock of this one
    kImpossible  // no lock is possible: the folder is not writable, or the file system has no locks
  };

  // Does not wait. If the lock is not taken, *why is one line.
  [[nodiscard]] Result take(const std::string& path, std::string* why);
  void release() { file_.reset(); }
  // Releases, and removes PATH.lock if this object created it.
  void release_and_remove();
  // PATH.lock if this object created it, else empty.
  [[nodiscard]] const std::string& made() const { return made_; }

 private:
  FileDescriptor file_;
  std::string made_;
};

}  // namespace alidade
