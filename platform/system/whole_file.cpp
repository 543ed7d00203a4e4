#include "platform/system/whole_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <system_error>
#include <utility>
#include <vector>

namespace alidade {

namespace {

constexpr const char* kUnfinished = ".unfinished-";
constexpr const char* kRandom = "XXXXXX";  // replaced by mkostemp with letters and digits

// A file beside the target: renamed onto it once it is synced to the disk, else removed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& target) : name_(target + kUnfinished + kRandom) {
    descriptor_ = ::mkostemp(name_.data(), O_CLOEXEC);
    // If the file system has no locks, nobody else can take one, either.
    if (descriptor_ >= 0) static_cast<void>(::flock(descriptor_, LOCK_EX | LOCK_NB));
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (descriptor_ < 0) return;
    ::close(descriptor_);
    if (!renamed_) ::unlink(name_.c_str());
  }

  // On false the reason is in errno.
  bool replace(const std::string& target, const std::string& content, mode_t mode) {
    if (descriptor_ < 0 || !write_all(descriptor_, content)) return false;
    // Until then only the owner can read the file: mkostemp sees to that.
    renamed_ = ::fchmod(descriptor_, mode) == 0 && ::fsync(descriptor_) == 0 &&
               ::rename(name_.c_str(), target.c_str()) == 0;
    return renamed_;
  }

 private:
  std::string name_;
  int descriptor_ = -1;
  bool renamed_ = false;
};

std::string folder_of(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  return slash == std::string::npos ? "." : path.substr(0, slash + 1);
}

// The name it would finally have; empty if this is not an unfinished file.
std::string finished_name(const std::string& name) {
  const std::size_t mark = name.rfind(kUnfinished);
  const std::size_t length = std::strlen(kUnfinished) + std::strlen(kRandom);
  return mark == std::string::npos || name.size() != mark + length ? "" : name.substr(0, mark);
}

// Unless a process is still writing it.
bool remove_left_over(const std::string& path) {
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return false;
  struct stat status {};
  const bool left_over = ::fstat(descriptor, &status) == 0 && S_ISREG(status.st_mode) &&
                         ::flock(descriptor, LOCK_EX | LOCK_NB) == 0 && ::unlink(path.c_str()) == 0;
  ::close(descriptor);
  return left_over;
}

// Makes the rename survive a power cut, if the file system can. Otherwise the old file may come
// back, whole.
void sync_folder_of(const std::string& path) {
  const int descriptor = ::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace

bool write_file_atomically(const std::string& path, const std::string& content, std::string* error,
                           unsigned mode) {
  const std::string own = std::filesystem::path(path).filename().string();
  remove_unfinished(folder_of(path), [&own](const std::string& name) { return name == own; });
  TemporaryFile file(path);
  if (!file.replace(path, content, mode)) {
    *error = path + ": cannot be written: " + std::strerror(errno);
    return false;
  }
  sync_folder_of(path);
  return true;
}

bool move_into_place(const std::string& from, const std::string& to, std::string* error) {
  const int descriptor = ::open(from.c_str(), O_RDONLY | O_CLOEXEC);
  const bool safe = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int code = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!safe) errno = code;
  if (!safe || ::rename(from.c_str(), to.c_str()) != 0) {
    *error = to + ": cannot be written: " + std::strerror(errno);
    return false;
  }
  sync_folder_of(to);
  return true;
}

int remove_unfinished(const std::string& folder,
                      const std::function<bool(const std::string& name)>& is_ours) {
  namespace fs = std::filesystem;
  std::vector<std::string> found;
  std::error_code error;
  for (fs::directory_iterator at(folder, error); !error && at != fs::directory_iterator();
       at.increment(error)) {
    const std::string target = finished_name(at->path().filename().string());
    if (!target.empty() && is_ours(target)) found.push_back(at->path().string());
  }
  int removed = 0;
  for (const std::string& path : found) removed += remove_left_over(path) ? 1 : 0;
  return removed;
}

bool write_all(int descriptor, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(n));
  }
  return true;
}

FileDescriptor open_to_read(const std::string& path, std::string* error) {
  const auto refuse = [&](const std::string& why) {
    *error = path + ": cannot be read: " + why;
    return FileDescriptor();
  };
  // A plain open would wait for a pipe's writer, and would take a terminal as the controlling one.
  FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  // open() gives ENXIO for a socket.
  if (!file.is_open() && errno == ENXIO) return refuse("not a file, but a socket or a device");
  if (!file.is_open()) return refuse(std::strerror(errno));
  struct stat status = {};
  if (::fstat(file.get(), &status) != 0) return refuse(std::strerror(errno));
  if (S_ISDIR(status.st_mode)) return refuse("not a file, but a folder");
  if (S_ISFIFO(status.st_mode)) return refuse("not a file, but a pipe");
  if (!S_ISREG(status.st_mode)) return refuse("not a file, but a device");
  return file;
}

bool read_file(const std::string& path, std::string* content, std::string* error,
               std::size_t most_bytes) {
  const FileDescriptor file = open_to_read(path, error);
  if (!file.is_open()) return false;
  const auto refuse = [&](const std::string& why) {
    *error = path + ": cannot be read: " + why;
    return false;
  };
  struct stat status = {};
  if (::fstat(file.get(), &status) != 0) return refuse(std::strerror(errno));
  const std::string too_large = "larger than " + std::to_string(most_bytes >> 20) + " MB";
  if (status.st_size > 0 && static_cast<std::uint64_t>(status.st_size) > most_bytes)
    return refuse(too_large);
  std::string bytes;
  bytes.reserve(static_cast<std::size_t>(status.st_size));
  // The file may grow meanwhile, and a file that the kernel generates on reading has size 0.
  for (char piece[16384];;) {
    const ssize_t n = ::read(file.get(), piece, sizeof piece);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return refuse(std::strerror(errno));
    if (n == 0) break;
    bytes.append(piece, static_cast<std::size_t>(n));
    if (bytes.size() > most_bytes) return refuse(too_large);
  }
  *content = std::move(bytes);
  return true;
}

}  // namespace alidade
