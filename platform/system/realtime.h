#pragma once
// What a thread asks of the kernel to meet its deadlines: SCHED_FIFO, a processor of its own, and
// memory that stays where it was touched: never paged out, never given back (these hold for the whole
// process), the stack touched beforehand. And the opposite, for a thread that must never be in the way.
// Everything is optional: without the permission the thread runs on, only less punctually.
// Threads started by a thread inherit its scheduling.

#include <pthread.h>

#include <cstddef>
#include <string>
#include <vector>

namespace alidade {

struct RealtimeOptions {
  int priority = 0;          // SCHED_FIFO priority 1..99; 0 leaves the normal scheduling
  int cpu = -1;              // processor to run on; -1: any
  bool lock_memory = false;  // lock_process_memory(), first
};

// What a thread does, for its place below the real-time one.
enum class ThreadDuty {
  kStep,     // the real-time thread's
  kBrief,    // stamping, telemetry, writing: microseconds at a time, and late stamps are wrong ones
  kDecoding  // milliseconds at a time
};

// The SCHED_FIFO priority that goes with a duty where the real-time thread has `priority`: the same, one and two lower, but never
// under 1, which is above all normal threads. 0 stays 0.
[[nodiscard]] int priority_of(ThreadDuty duty, int priority);

// A few words for each thing that was granted ("SCHED_FIFO 60"), and a line in plain words for each
// that was not permitted, with what would permit it.
struct RealtimeReport {
  std::vector<std::string> granted;
  std::vector<std::string> warnings;

  // For the log: "granted: SCHED_FIFO 60, processor 3, memory locked, stack pre-faulted; not permitted: ...".
  [[nodiscard]] std::string line() const;
};

// Locks all memory of the process, now and later, and keeps malloc from returning blocks below kFetchedAlone to the kernel: fresh
// memory is a page fault. Brought in are all data that there are, this program and the C and C++ libraries, but for their tables for
// exceptions, where these lie among constants, and the program's code that no thread on a record's way enters (cmake/batch_code.ld); what comes later stays once it was
// touched. Of the other libraries, a hundred MB of codecs, nothing is kept but what is used from now on: what the loader alone has
// needed is let go. Before other threads are started, so that none of their stacks is brought in as a whole.
inline constexpr std::size_t kFetchedAlone = std::size_t{512} << 10;  // bytes
[[nodiscard]] RealtimeReport lock_process_memory();

// Applies the options to the calling thread and touches kPrefaultedStack of its stack, if it has that much.
// Allocates.
inline constexpr std::size_t kPrefaultedStack = std::size_t{256} << 10;  // bytes
[[nodiscard]] RealtimeReport apply_realtime(const RealtimeOptions& options);

// Gives memory that was freed back to the kernel, unless the process keeps it (lock_memory). Allocation by other
// threads waits meanwhile: for a thread that has just freed megabytes.
void return_freed_memory();

// Lets the calling thread run only when no other wants to (SCHED_IDLE, else the highest nice value), whatever
// the thread that started it runs as. Returns one line if it could not be had; empty = granted.
[[nodiscard]] std::string set_lowest_priority();

// Undoes it for another thread, so that one that shall end does on a busy machine, too. False: the kernel refused, as it does
// below RLIMIT_NICE 20 without CAP_SYS_NICE.
bool set_usual_priority(pthread_t thread);

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
