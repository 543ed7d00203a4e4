#include "platform/system/file_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "platform/system/shown.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

constexpr std::size_t kMostBytes = 300;

// Number and command of this process, as written into the lock file.
std::string this_process() {
  std::string command;
  std::string ignored;
  if (!read_file("/proc/self/cmdline", &command, &ignored)) command.clear();
  while (!command.empty() && command.back() == '\0') command.pop_back();
  std::replace(command.begin(), command.end(), '\0', ' ');
  return std::to_string(::getpid()) +
         (command.empty() ? "" : " (" + shown(command, kMostBytes - 40) + ")") + "\n";
}

std::string holder_of(int file) {
  char text[kMostBytes];
  const ssize_t size = ::pread(file, text, sizeof text, 0);
  const std::string_view all(text, static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  // Not written yet: the lock was taken just now.
  const std::size_t end = all.find('\n');
  return end == std::string_view::npos ? "another process"
                                       : "process " + shown(all.substr(0, end), kMostBytes);
}

// False if the previous owner removed the file after it was opened here and before it was locked.
bool stands_there(int file, const std::string& name) {
  struct stat opened = {};
  struct stat named = {};
  return ::fstat(file, &opened) == 0 && ::lstat(name.c_str(), &named) == 0 &&
         opened.st_dev == named.st_dev && opened.st_ino == named.st_ino;
}

}  // namespace

FileLock::Result FileLock::take(const std::string& path, std::string* why) {
  const std::string name = path + ".lock";
  const auto impossible = [&](const std::string& reason) {
    *why = name + ": cannot be locked: " + reason;
    return Result::kImpossible;
  };
  constexpr int kFlags = O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY;
  FileDescriptor file(::open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | kFlags, 0644));
  const bool is_made = file.is_open();
  if (!is_made) file.reset(::open(name.c_str(), O_RDWR | O_CREAT | kFlags, 0644));
  // A file of another user: it can be locked, but not written.
  if (!file.is_open() && (errno == EACCES || errno == EROFS))
    file.reset(::open(name.c_str(), O_RDONLY | kFlags));
  if (!file.is_open()) return impossible(errno == ELOOP ? "it is a link" : std::strerror(errno));
  struct stat status = {};
  if (::fstat(file.get(), &status) != 0) return impossible(std::strerror(errno));
  if (!S_ISREG(status.st_mode)) return impossible("it is not a file");
  if (::flock(file.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return impossible(std::strerror(errno));
    *why = path + ": in use by " + holder_of(file.get());
    return Result::kInUse;
  }
  if (!stands_there(file.get(), name)) return take(path, why);
  const std::string holder = this_process();
  // For information only: the lock holds without it.
  if (::ftruncate(file.get(), 0) == 0)
    static_cast<void>(::pwrite(file.get(), holder.data(), holder.size(), 0) < 0);
  file_ = std::move(file);
  made_ = is_made ? name : "";
  return Result::kTaken;
}

void FileLock::release_and_remove() {
  if (file_.is_open() && !made_.empty()) ::unlink(made_.c_str());
  made_.clear();
  release();
}

}  // namespace alidade
