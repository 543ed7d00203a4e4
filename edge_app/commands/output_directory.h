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

// To be held while calibration.yaml is made for it. Throws CommandError where a `run` keeps its calibrations in that file.
[[nodiscard]] FileLock lock_calibration_in(const std::string& directory);

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
