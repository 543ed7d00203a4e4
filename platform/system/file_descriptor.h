#pragma once
// FileDescriptor: owns one open file descriptor and closes it.

#include <utility>

namespace alidade {

class FileDescriptor {
 public:
  FileDescriptor() = default;
  // number: as returned by open(), socket() and the like; negative: none.
  explicit FileDescriptor(int number) : number_(number) {}
  ~FileDescriptor() { reset(); }
  FileDescriptor(FileDescriptor&& other) noexcept : number_(other.release()) {}
  FileDescriptor& operator=(FileDescriptor&& other) noexcept {
    reset(other.release());
    return *this;
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;

  [[nodiscard]] bool is_open() const { return number_ >= 0; }
  [[nodiscard]] int get() const { return number_; }  // negative: none

  // Closes the current descriptor, then owns number. Preserves errno.
  void reset(int number = kNone);
  // Gives up ownership without closing.
  [[nodiscard]] int release() { return std::exchange(number_, kNone); }

 private:
  static constexpr int kNone = -1;
  int number_ = kNone;
};

}  // namespace alidade
