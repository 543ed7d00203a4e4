#include "edge_app/commands/output_directory.h"

#include <signal.h>
#include <unistd.h>

#include <filesystem>
#include <system_error>

#include "edge_app/commands/command.h"
#include "platform/system/whole_file.h"

namespace alidade {

namespace fs = std::filesystem;
namespace {

constexpr int kEndings[] = {SIGINT, SIGTERM, SIGHUP};
const OutputLock* held = nullptr;

void change_endings(void (*from)(int), void (*to)(int)) {
  for (const int signal : kEndings) {
    struct sigaction now = {};
    // Leave a signal alone that others handle or ignore.
    if (::sigaction(signal, nullptr, &now) != 0 || now.sa_handler != from) continue;
    struct sigaction next = {};
    next.sa_handler = to;
    next.sa_flags = static_cast<int>(SA_RESETHAND);
    static_cast<void>(::sigaction(signal, &next, nullptr));
  }
}

}  // namespace

std::string output_path(const std::string& given, const std::string& recording) {
  std::error_code error;
  const fs::path from(recording);
  const fs::path beside = fs::is_directory(from, error) ? from : from.parent_path();
  return given.empty() ? (beside / "alidade").string() : given;
}

OutputLock::OutputLock(const std::string& file) {
  std::error_code error;
  const fs::path folder = fs::absolute(file, error).parent_path();
  for (fs::path one = folder; !one.empty() && !fs::exists(one, error) && !error;
       one = one.parent_path())
    made_.push_back(one.string());
  fs::create_directories(folder, error);
  std::string why;
  if (lock_.take(file, &why) == FileLock::Result::kInUse)
    throw CommandError(kExitFailed, why + "; give another place with -o, or wait for it to end");
  held = this;
  change_endings(SIG_DFL, &OutputLock::end);
}

// Signal handler: calls only async-signal-safe functions. The raised signal has its default effect
// as soon as this returns.
void OutputLock::end(int signal) {
  if (!held->lock_.made().empty()) static_cast<void>(::unlink(held->lock_.made().c_str()));
  for (const std::string& folder : held->made_) static_cast<void>(::rmdir(folder.c_str()));
  static_cast<void>(::raise(signal));
}

OutputLock::~OutputLock() {
  change_endings(&OutputLock::end, SIG_DFL);
  held = nullptr;
  lock_.release_and_remove();
  std::error_code not_empty;
  for (const std::string& folder : made_) fs::remove(folder, not_empty);
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
