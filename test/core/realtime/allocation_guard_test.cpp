#include "test/support/allocation_guard.h"

#include <gtest/gtest.h>
#include <malloc.h>

#include <Eigen/Core>
#include <cstdlib>
#include <memory>
#include <new>
#include <string>
#include <thread>

namespace alidade::test {
namespace {

// Keeps the compiler from removing an allocation that nobody looks at.
void* escape(void* pointer) {
  asm volatile("" : : "g"(pointer) : "memory");
  return pointer;
}

TEST(AllocationGuard, CountsNothingWhereNothingIsAllocated) {
  const AllocationGuard guard;
  std::free(escape(nullptr));
  EXPECT_EQ(guard.count(), 0);
}

TEST(AllocationGuard, CountsMallocAndFree) {
  const AllocationGuard guard;
  void* const pointer = escape(std::malloc(17));
  EXPECT_EQ(guard.count(), 1);
  std::free(pointer);
  EXPECT_EQ(guard.count(), 2);
}

TEST(AllocationGuard, CountsCallocAndRealloc) {
  AllocationGuard guard;
  void* pointer = escape(std::calloc(3, 17));
  EXPECT_EQ(guard.count(), 1);
  pointer = escape(std::realloc(pointer, 100000));
  EXPECT_GE(guard.count(), 2);
  std::free(pointer);
}

TEST(AllocationGuard, CountsTheAlignedFunctions) {
  if (!AllocationGuard::counts_aligned_functions()) GTEST_SKIP() << "the sanitizer keeps silent";
  const AllocationGuard guard;
  void* const by_c11 = escape(std::aligned_alloc(64, 128));
  EXPECT_EQ(guard.count(), 1);
  void* by_posix = nullptr;
  ASSERT_EQ(posix_memalign(&by_posix, 64, 100), 0);
  escape(by_posix);
  EXPECT_EQ(guard.count(), 2);
  void* const by_glibc = escape(memalign(64, 100));
  EXPECT_EQ(guard.count(), 3);
  std::free(by_c11);
  std::free(by_posix);
  std::free(by_glibc);
  EXPECT_EQ(guard.count(), 6);
}

TEST(AllocationGuard, CountsOperatorNewAndDelete) {
  const AllocationGuard guard;
  auto* const one = static_cast<int*>(escape(new int(3)));
  EXPECT_EQ(guard.count(), 1);
  delete one;
  EXPECT_EQ(guard.count(), 2);
  auto* const many = static_cast<int*>(escape(new int[30]));
  EXPECT_EQ(guard.count(), 3);
  delete[] many;
  EXPECT_EQ(guard.count(), 4);
  struct alignas(128) Wide {
    char bytes[128];
  };
  auto* const wide = static_cast<Wide*>(escape(new Wide));
  EXPECT_EQ(guard.count(), 5);
  delete wide;
  EXPECT_EQ(guard.count(), 6);
}

TEST(AllocationGuard, CountsAnEigenMatrixOfDynamicSize) {
  const volatile int size = 5;
  const AllocationGuard guard;
  {
    Eigen::VectorXd vector(size);
    escape(vector.data());
  }
  EXPECT_EQ(guard.count(), 2);
}

TEST(AllocationGuard, CountsWhatALibraryAllocates) {
  const AllocationGuard guard;
  std::string text = std::to_string(1) + std::string(200, 'x');  // libstdc++
  escape(text.data());
  EXPECT_GE(guard.count(), 1);
}

TEST(AllocationGuard, LeavesOtherThreadsOut) {
  std::int64_t in_thread = 0;
  std::int64_t here = -1;
  std::thread([&] {
    const AllocationGuard guard;
    std::free(escape(std::malloc(17)));
    in_thread = guard.count();
  }).join();
  {
    const AllocationGuard guard;
    here = guard.count();
  }
  EXPECT_EQ(in_thread, 2);
  EXPECT_EQ(here, 0);
}

}  // namespace
}  // namespace alidade::test
