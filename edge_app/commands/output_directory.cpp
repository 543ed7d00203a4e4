#include "edge_app/commands/output_directory.h"

#include <filesystem>
#include <system_error>

#include "edge_app/commands/command.h"
#include "platform/system/whole_file.h"

namespace alidade {

namespace fs = std::filesystem;

std::string output_path(const std::string& given, const std::string& recording) {
  std::error_code error;
  const fs::path from(recording);
  const fs::path beside = fs::is_directory(from, error) ? from : from.parent_path();
  return given.empty() ? (beside / "alidade").string() : given;
}

FileLock lock_calibration_in(const std::string& directory) {
  const std::string file = (fs::path(directory) / "calibration.yaml").string();
  FileLock lock;
  std::string why;
  std::error_code ignored;
  if (fs::exists(file + ".lock", ignored) && lock.take(file, &why) == FileLock::Result::kInUse)
    throw CommandError(kExitFailed, why + "; give another directory with -o");
  return lock;
}

OutputDirectory::OutputDirectory(const std::string& given, const std::string& recording) {
  std::error_code error;
  const fs::path path = output_path(given, recording);
  fs::create_directories(path, error);
  if (error) {
    throw CommandError(kExitFailed, path.string() + ": cannot be made: " + error.message() +
                                        "; give a directory that can be written with -o");
  }
  path_ = path.string();
}

void OutputDirectory::add(const char* kind, const char* name, const Write& write) {
  const std::string path = (fs::path(path_) / name).string();
  std::string error;
  if (!write(path, &error))
    throw CommandError(kExitFailed, error + "; give a directory with room with -o");
  files_.emplace_back(kind, path);
}

void OutputDirectory::add(const char* kind, const char* name, const std::string& text) {
  add(kind, name, [&](const std::string& path, std::string* error) {
    return write_file_atomically(path, text, error);
  });
}

}  // namespace alidade
