#pragma once
// Loads a user's network first in a process of its own: this program, started again with a hidden
// option. A file that was cut, changed or forged can crash the library that reads it, or make it
// take all memory. Then only that process ends, and the file is refused. The process has limits of
// memory and time, leaves no core dump, and dies with its parent.

#include <string>

#include "core/detection/network_detector.h"

namespace alidade {

inline constexpr const char* kNetworkTrial = "--try-network";

// Called by main() of the program that knows the option. Without it there are no trials.
void allow_network_trials();

// False with one line: the detector's error, or how the process ended. Also true if trials are not
// allowed or the process cannot be started.
[[nodiscard]] bool survives_trial(const std::string& model, const NetworkOptions& options,
                                  std::string* error);

// The trial's process: reads the model from stdin and prints the error on stdout. Returns its exit
// code.
int run_network_trial(int argc, char** argv);

}  // namespace alidade
