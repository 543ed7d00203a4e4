#pragma once
// The directory in which a command leaves its files. It is made if it does not exist. If a file
// cannot be written, the command ends.

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "platform/system/file_lock.h"

namespace alidade {

// given: the argument of -o. If it is empty: `alidade` inside the recording if that is a directory,
// else beside it.
[[nodiscard]] std::string output_path(const std::string& given, const std::string& recording);

// A lock on an output file, held while a command works. Another command that would write the file
// fails and names the holder. A `run` that stores its calibrations in the same file holds the same
// lock. The constructor makes the file's folder. Nothing of the lock stays behind, not even if
// SIGINT, SIGTERM or SIGHUP ends the program; a folder that it made and that is still empty does
// not stay, either. Where no lock can be taken (file system without locks, folder not writable),
// none is. Only one object may exist at a time.
class OutputLock {
 public:
  // Throws CommandError if the file is in use.
  explicit OutputLock(const std::string& file);
  ~OutputLock();
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;

 private:
  static void end(int signal);

  FileLock lock_;
  std::vector<std::string> made_;  // folders, innermost first
};

class OutputDirectory {
 public:
  // The arguments of output_path(). Throws CommandError if the directory cannot be made.
  OutputDirectory(const std::string& given, const std::string& recording);

  // Writes a file of this name in the directory and remembers it under `kind`. write(path, &error)
  // returns whether it succeeded. Throws CommandError if the file cannot be written.
  using Write = std::function<bool(const std::string&, std::string*)>;
  void add(const char* kind, const char* name, const Write& write);
  void add(const char* kind, const char* name, const std::string& text);

  // Kind and path of each file, in the order of writing.
  [[nodiscard]] const std::vector<std::pair<std::string, std::string>>& files() const {
    return files_;
  }

 private:
  std::string path_;
  std::vector<std::pair<std::string, std::string>> files_;
};

}  // namespace alidade
