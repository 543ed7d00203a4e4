#include "test/support/allocation_guard.h"

#include <cerrno>
#include <cstddef>

#include "test/support/sanitizer.h"

namespace {

// Constant-initialised and in the program itself: reading it never allocates.
thread_local std::int64_t heap_uses = 0;

}  // namespace

#if defined(ALIDADE_ADDRESS_SANITIZER) || defined(ALIDADE_THREAD_SANITIZER)

extern "C" int __sanitizer_install_malloc_and_free_hooks(void (*malloc_hook)(const volatile void*,
                                                                             std::size_t),
                                                         void (*free_hook)(const volatile void*));

namespace {

void on_malloc(const volatile void*, std::size_t) { ++heap_uses; }
void on_free(const volatile void* pointer) {
  if (pointer != nullptr) ++heap_uses;
}

const int hooks_installed = __sanitizer_install_malloc_and_free_hooks(on_malloc, on_free);

}  // namespace

#else

extern "C" {

void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* pointer, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void __libc_free(void* pointer);

void* malloc(std::size_t size) noexcept {
  ++heap_uses;
  return __libc_malloc(size);
}

void* calloc(std::size_t count, std::size_t size) noexcept {
  ++heap_uses;
  return __libc_calloc(count, size);
}

void* realloc(void* pointer, std::size_t size) noexcept {
  ++heap_uses;
  return __libc_realloc(pointer, size);
}

void* memalign(std::size_t alignment, std::size_t size) noexcept {
  ++heap_uses;
  return __libc_memalign(alignment, size);
}

void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  ++heap_uses;
  return __libc_memalign(alignment, size);
}

int posix_memalign(void** pointer, std::size_t alignment, std::size_t size) noexcept {
  ++heap_uses;
  if (alignment % sizeof(void*) != 0 || (alignment & (alignment - 1)) != 0) return EINVAL;
  void* const allocated = __libc_memalign(alignment, size);
  if (allocated == nullptr) return ENOMEM;
  *pointer = allocated;
  return 0;
}

void free(void* pointer) noexcept {
  if (pointer != nullptr) ++heap_uses;
  __libc_free(pointer);
}

}  // extern "C"

#endif

namespace alidade::test {

AllocationGuard::AllocationGuard() : at_start_(heap_uses) {}

std::int64_t AllocationGuard::count() const { return heap_uses - at_start_; }

bool AllocationGuard::counts_aligned_functions() {
#ifdef ALIDADE_THREAD_SANITIZER
  return false;
#else
  return true;
#endif
}

}  // namespace alidade::test
