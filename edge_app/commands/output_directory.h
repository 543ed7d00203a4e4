#pragma once
// Where a command leaves its files: made if it is not there. What cannot be written ends the command.

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "platform/system/file_lock.h"

namespace alidade {

// given: of -o; empty: `alidade` in the recording, or beside it if it is a file.
[[nodiscard]] std::string output_path(const std::string& given, const std::string& recording);

// Held while a command makes what it will write: another one that would write there says who has it, as where a `run` keeps its
// calibrations in that file. Makes the file's folder, and leaves nothing of its own behind, not even where SIGINT, SIGTERM or SIGHUP
// ends the program meanwhile. Where there can be no lock there is none. One at a time.
class OutputLock {
 public:
  // Throws CommandError where it is in use.
  explicit OutputLock(const std::string& file);
  ~OutputLock();
  OutputLock(const OutputLock&) = delete;
  OutputLock& operator=(const OutputLock&) = delete;

 private:
  static void end(int signal);

  FileLock lock_;
  std::vector<std::string> made_;  // folders, the innermost first
};

class OutputDirectory {
 public:
  // Of output_path(). Throws CommandError.
  OutputDirectory(const std::string& given, const std::string& recording);

  // write(path, &error) -> bool. Remembers the file under `kind`. Throws CommandError.
  using Write = std::function<bool(const std::string&, std::string*)>;
  void add(const char* kind, const char* name, const Write& write);
  void add(const char* kind, const char* name, const std::string& text);

  // Kind and path of each, in the order of writing.
  [[nodiscard]] const std::vector<std::pair<std::string, std::string>>& files() const {
    return files_;
  }

 private:
  std::string path_;
  std::vector<std::pair<std::string, std::string>> files_;
};

}  // namespace alidade
