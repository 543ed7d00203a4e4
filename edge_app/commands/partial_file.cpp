#include "edge_app/commands/partial_file.h"

#include <fcntl.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "edge_app/commands/command.h"

namespace alidade {

namespace fs = std::filesystem;

PartialFile::PartialFile(std::string path)
    : path_(std::move(path)),
      partial_(path_ + ".partial"),
      file_(::open(partial_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)) {
  if (!file_.is_open()) {
    throw CommandError(kExitFailed,
                       partial_ + ": cannot be written: " + std::generic_category().message(errno) +
                           "; give a directory that can be written with -o");
  }
}

PartialFile::~PartialFile() {
  std::error_code ignored;
  fs::remove(partial_, ignored);  // after complete() there is none
}

void PartialFile::complete() {
  file_.reset();
  std::error_code error;
  fs::rename(partial_, path_, error);
  if (error) throw CommandError(kExitFailed, path_ + ": cannot be written: " + error.message());
}

}  // namespace alidade
