#pragma once
// run_child(): starts a program, waits for its end and gathers what it says. For work whose memory
// or crash must not be this process's.

#include <cstddef>
#include <string>
#include <vector>

namespace alidade {

struct ChildCommand {
  std::string program;                 // path of the executable
  std::vector<std::string> arguments;  // from the program's name on
  int input = -1;                      // descriptor that becomes its stdin; negative: /dev/null
  double longest_s = 0;                // it is killed then, > 0
  int ends = -1;               // descriptor; it is killed once that is readable; negative: none
  std::size_t most_bytes = 0;  // of each of stdout and stderr; what is beyond is left out
};

struct ChildResult {
  std::string not_started;  // why; the rest is then empty. Empty: it was started
  bool has_ended = false;   // by itself; false: it was killed
  int status = 0;           // of waitpid()
  std::string out, errors;  // its stdout and stderr
};

// The process inherits the calling thread's scheduling.
[[nodiscard]] ChildResult run_child(const ChildCommand& command);

}  // namespace alidade
