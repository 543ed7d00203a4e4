#pragma once
// What a thread asks of the kernel to meet its deadlines: SCHED_FIFO, a processor of its own, and
// memory that is there when it is touched: never paged out, never given back (these hold for the whole
// process), the stack touched beforehand. And the opposite, for a thread that must never be in the way.
// Everything is optional: without the permission the thread runs on, only less punctually.
// Threads started by a thread inherit its scheduling.

#include <cstddef>
#include <string>
#include <vector>

namespace alidade {

struct RealtimeOptions {
  int priority = 0;  // SCHED_FIFO priority 1..99; 0 leaves the normal scheduling
  int cpu = -1;      // processor to run on; -1: any
  // Locks all memory of the process, now and later, and keeps malloc from returning it to the kernel
  // and from fetching large blocks one by one: fresh memory is a page fault. Heap and stacks, now and later, this
  // program and the C and C++ libraries are brought in; what else was linked with other libraries, a hundred MB of
  // codecs, is kept once it was used.
  bool lock_memory = false;
};

// A few words for each thing that was granted ("SCHED_FIFO 60"), and a line in plain words for each
// that was not permitted, with what would permit it.
struct RealtimeReport {
  std::vector<std::string> granted;
  std::vector<std::string> warnings;

  // For the log: "granted: SCHED_FIFO 60, processor 3, memory locked, stack pre-faulted; not permitted: ...".
  [[nodiscard]] std::string line() const;
};

// Applies the options to the calling thread and touches kPrefaultedStack of its stack, if it has that much.
// Allocates.
inline constexpr std::size_t kPrefaultedStack = std::size_t{256} << 10;  // bytes
[[nodiscard]] RealtimeReport apply_realtime(const RealtimeOptions& options);

// Stacks of threads that are started from now on are of this size: locked memory holds all of each, of which glibc's
// default is 8 MB. Returns whether it could be had.
inline constexpr std::size_t kThreadStack = std::size_t{2} << 20;  // bytes
[[nodiscard]] bool use_small_stacks();

// Gives memory that was freed back to the kernel, unless the process keeps it (lock_memory). Allocation by other
// threads waits meanwhile: for a thread that has just freed megabytes.
void return_freed_memory();

// Lets the calling thread run only when no other wants to (SCHED_IDLE, else the highest nice value), whatever
// the thread that started it runs as. Returns one line if it could not be had; empty = granted.
[[nodiscard]] std::string set_lowest_priority();

// Of the calling thread, since it began.
struct PageFaults {
  long minor = 0;  // the page was in memory, but not there yet for this process
  long major = 0;  // it had to be read
};
[[nodiscard]] PageFaults thread_page_faults();
// Of another thread of this process, by its number; zeros once it has ended.
[[nodiscard]] PageFaults page_faults_of(int thread);
[[nodiscard]] int this_thread();

}  // namespace alidade
