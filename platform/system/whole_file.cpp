#include "platform/system/whole_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>

namespace alidade {

namespace {

// A file beside the target, renamed onto it once it is safely on disk; otherwise removed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& target) : name_(target + ".XXXXXX") {
    descriptor_ = ::mkostemp(name_.data(), O_CLOEXEC);
  }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;
  ~TemporaryFile() {
    if (descriptor_ < 0) return;
    ::close(descriptor_);
    if (!renamed_) ::unlink(name_.c_str());
  }

  // False leaves the reason in errno.
  bool replace(const std::string& target, const std::string& content) {
    if (descriptor_ < 0) return false;
    std::size_t written = 0;
    while (written < content.size()) {
      const ssize_t n = ::write(descriptor_, content.data() + written, content.size() - written);
      if (n < 0 && errno == EINTR) continue;
      if (n < 0) return false;
      written += static_cast<std::size_t>(n);
    }
    // mkostemp lets the owner alone read it; what is stored here is no secret.
    renamed_ = ::fchmod(descriptor_, 0644) == 0 && ::fsync(descriptor_) == 0 &&
               ::rename(name_.c_str(), target.c_str()) == 0;
    return renamed_;
  }

 private:
  std::string name_;
  int descriptor_ = -1;
  bool renamed_ = false;
};

// Makes the rename survive a power cut, where the file system can do so; elsewhere the old file,
// whole, may come back.
void sync_folder_of(const std::string& path) {
  const std::size_t slash = path.find_last_of('/');
  const std::string folder = slash == std::string::npos ? "." : path.substr(0, slash + 1);
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;
  ::fsync(descriptor);
  ::close(descriptor);
}

}  // namespace

bool write_file_atomically(const std::string& path, const std::string& content,
                           std::string* error) {
  TemporaryFile file(path);
  if (!file.replace(path, content)) {
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

bool read_file(const std::string& path, std::string* content, std::string* error) {
  std::ifstream file(path, std::ios::binary);
  file.peek();  // a folder opens, but cannot be read
  if (!file.is_open() || file.bad()) {
    *error = path + ": cannot be read: " + std::strerror(errno);
    return false;
  }
  std::ostringstream bytes;
  bytes << file.rdbuf();
  *content = bytes.str();
  return true;
}

}  // namespace alidade
