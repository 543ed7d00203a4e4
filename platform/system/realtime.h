#pragma once
// Scheduling and memory of threads that must meet deadlines: SCHED_FIFO, a processor of its own, a
// pre-faulted stack, and memory that is never paged out or given back (for the whole process). Also
// the opposite: threads that must never be in the way. Everything is optional: without permission a
// thread runs on, only less punctually. A thread inherits the scheduling of the thread that starts
// it.

#include <pthread.h>

#include <cstddef>
#include <string>
#include <vector>

namespace alidade {

struct RealtimeOptions {
  int priority = 0;          // SCHED_FIFO, 1 to 99; 0: leaves the normal scheduling
  int cpu = -1;              // processor to run on; -1: any
  bool lock_memory = false;  // lock_process_memory(), first
};

// What a thread does; decides its priority below the real-time thread's.
enum class ThreadDuty {
  kStep,     // the real-time thread
  kBrief,    // stamping, telemetry, writing: microseconds at a time; late stamps are wrong ones
  kDecoding  // milliseconds at a time
};

// SCHED_FIFO priority of a duty if the real-time thread has `priority`: the same, 1 lower or 2
// lower, but never below 1, which is above all normal threads. 0 stays 0.
[[nodiscard]] int priority_of(ThreadDuty duty, int priority);

// granted: a few words for each thing that was granted ("SCHED_FIFO 60"). warnings: one plain line
// for each that was not permitted, with what would permit it.
struct RealtimeReport {
  std::vector<std::string> granted;
  std::vector<std::string> warnings;

  // For the log: "granted: SCHED_FIFO 60, processor 3, memory locked; not permitted: ...".
  [[nodiscard]] std::string line() const;
};

// Locks all memory of the process, present and future. Keeps malloc from returning blocks below
// kFetchedAlone to the kernel, as fresh memory costs a page fault. Pages in at once all data, this
// program, and the C and C++ libraries. Exception tables among constants, and program code that no
// thread on a record's way enters (cmake/batch_code.ld), stay once they are touched, and so does
// later memory. In other libraries (100 MB of codecs) only pages that are used from now on stay;
// pages that only the loader needed are released. To be called before other threads start, or their
// whole stacks are paged in.
inline constexpr std::size_t kFetchedAlone = std::size_t{512} << 10;  // bytes
[[nodiscard]] RealtimeReport lock_process_memory();

// Applies the options to the calling thread, and touches kPrefaultedStack of its stack if the stack
// is large enough. Allocates.
inline constexpr std::size_t kPrefaultedStack = std::size_t{256} << 10;  // bytes
[[nodiscard]] RealtimeReport apply_realtime(const RealtimeOptions& options);

// Returns freed memory to the kernel, unless the process keeps it (lock_memory). Blocks allocation
// by other threads meanwhile. For a thread that has just freed megabytes.
void return_freed_memory();

// Lets the calling thread run only when no other wants to (SCHED_IDLE, else the highest nice
// value), on the processors of the process's first thread, whatever scheduling and processor it
// inherited. Returns one line if the priority was refused; empty: granted.
[[nodiscard]] std::string set_lowest_priority();

// Returns another thread to the normal policy, so that a thread that is to end does so even on a
// busy machine. False: the kernel refused, as with an RLIMIT_NICE below 20 without CAP_SYS_NICE.
bool set_usual_priority(pthread_t thread);

// Page faults of the calling thread since it started.
struct PageFaults {
  long minor = 0;  // the page was in memory, but not mapped by this process yet
  long major = 0;  // the page had to be read from disk
};
[[nodiscard]] PageFaults thread_page_faults();
// The same of another thread of this process, by its kernel thread id. Zeros once the thread has
// ended.
[[nodiscard]] PageFaults page_faults_of(int thread);
[[nodiscard]] int this_thread();

}  // namespace alidade
