#pragma once
// What a thread asks of the kernel to meet its deadlines: SCHED_FIFO, a processor of its own, and
// memory that is never paged out (this one holds for the whole process).
// Everything is optional: without the permission the thread runs on, only less punctually.
// Threads started by a thread inherit its scheduling.

#include <string>
#include <vector>

namespace alidade {

struct RealtimeOptions {
  int priority = 0;  // SCHED_FIFO priority 1..99; 0 leaves the normal scheduling
  int cpu = -1;      // processor to run on; -1: any
  bool lock_memory = false;
};

// Applies the options to the calling thread. Returns one line in plain words for each thing that
// was not permitted, with what would permit it; empty = all granted.
[[nodiscard]] std::vector<std::string> apply_realtime(const RealtimeOptions& options);

// The calling thread runs when nothing else wants to. Lines as above.
[[nodiscard]] std::vector<std::string> set_lowest_priority();

}  // namespace alidade
