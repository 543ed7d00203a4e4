#pragma once
// FreshMemory: memory that nobody has touched, in small pages: the first touch of each page is a page fault.

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>

#include "test/support/sanitizer.h"

namespace alidade::test {

// False: the sanitizers touch memory besides the program's.
#if defined(ALIDADE_ADDRESS_SANITIZER) || defined(ALIDADE_THREAD_SANITIZER)
inline constexpr bool kOwnMemoryOnly = false;
#else
inline constexpr bool kOwnMemoryOnly = true;
#endif

class FreshMemory {
 public:
  explicit FreshMemory(std::size_t size)
      : size_(size),
        data_(::mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0)) {
    if (data_ == MAP_FAILED) std::abort();
    static_cast<void>(::madvise(data_, size_, MADV_NOHUGEPAGE));
  }
  FreshMemory(const FreshMemory&) = delete;
  FreshMemory& operator=(const FreshMemory&) = delete;
  ~FreshMemory() { ::munmap(data_, size_); }

  [[nodiscard]] char* data() const { return static_cast<char*>(data_); }
  [[nodiscard]] std::size_t size() const { return size_; }

 private:
  std::size_t size_;
  void* data_;
};

}  // namespace alidade::test
