#pragma once
// Loads a user's network first in a process of its own: this program, started again with a hidden
// option. A file that was cut, changed or forged can crash the library that reads it, or make the
// library take all memory. Then only that process ends, and the file is refused. The process may
// take 4 GiB of address space plus eight times the model's size (no limit on 32 bits and with a
// sanitizer) and 120 s. It leaves no core dump and dies with its parent.

#include <string>

#include "core/detection/network_detector.h"

namespace alidade {

inline constexpr const char* kNetworkTrial = "--try-network";

// Called by the main() that calls run_network_trial() for kNetworkTrial. Before this call there are
// no trials: survives_trial() returns true.
void allow_network_trials();

// Waits for the process. model: the bytes of the network's file, not its path. False and one line
// in *error: the detector's error, or how the process ended. Also true if trials are not allowed or
// the process cannot be started.
[[nodiscard]] bool survives_trial(const std::string& model, const NetworkOptions& options,
                                  std::string* error);

// The trial's process. argv: program, kNetworkTrial, width, height (px). Reads the model from
// stdin, which must be a file. Returns the exit code: 0: the model can be loaded; 3: it cannot, and
// the reason is on stdout.
int run_network_trial(int argc, char** argv);

}  // namespace alidade
