#pragma once
// AllocationGuard: how often the calling thread has used the heap since the guard was made.
//
//   AllocationGuard guard;
//   real_time_call();
//   EXPECT_EQ(guard.count(), 0);
//
// Counts malloc, calloc, realloc, free, aligned_alloc, posix_memalign and memalign, and so operator
// new and delete, which end there: those of the program and those of every library it has loaded.
// allocation_guard.cpp, which every program that uses the guard compiles in, replaces glibc's
// functions by counting ones, on every processor; under the address or thread sanitizer, which
// replace them already, it registers the sanitizer's hooks instead. free(nullptr) is not counted.
// The thread sanitizer does not report the three aligned C functions: counts_aligned_functions().

#include <cstdint>

namespace alidade::test {

class AllocationGuard {
 public:
  AllocationGuard();
  AllocationGuard(const AllocationGuard&) = delete;
  AllocationGuard& operator=(const AllocationGuard&) = delete;

  // Allocations and releases of this thread since construction.
  [[nodiscard]] std::int64_t count() const;

  [[nodiscard]] static bool counts_aligned_functions();

 private:
  std::int64_t at_start_;
};

}  // namespace alidade::test
