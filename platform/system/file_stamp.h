#pragma once
// FileStamp: detects that a file was changed or replaced, by device, inode, size and times. Two
// writes within one tick of the file system's clock (some milliseconds) that leave the same size
// cannot be distinguished. Stamps of files that cannot be found are equal, and equal to a
// default-constructed one.

#include <sys/stat.h>

#include <string>

namespace alidade {

class FileStamp {
 public:
  FileStamp() = default;
  explicit FileStamp(const std::string& path) { is_there_ = ::stat(path.c_str(), &status_) == 0; }

  [[nodiscard]] bool operator==(const FileStamp& other) const {
    if (!is_there_ || !other.is_there_) return is_there_ == other.is_there_;
    const auto same_time = [](const timespec& a, const timespec& b) {
      return a.tv_sec == b.tv_sec && a.tv_nsec == b.tv_nsec;
    };
    return status_.st_dev == other.status_.st_dev && status_.st_ino == other.status_.st_ino &&
           status_.st_size == other.status_.st_size &&
           same_time(status_.st_mtim, other.status_.st_mtim) &&
           same_time(status_.st_ctim, other.status_.st_ctim);
  }
  [[nodiscard]] bool operator!=(const FileStamp& other) const { return !(*this == other); }

  // True if any user of the machine may read it.
  [[nodiscard]] bool is_public() const { return is_there_ && (status_.st_mode & S_IROTH) != 0; }

 private:
  bool is_there_ = false;
  struct stat status_ = {};
};

}  // namespace alidade
