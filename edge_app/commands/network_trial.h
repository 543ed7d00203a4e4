#pragma once
// A user's network, loaded first in a process of its own: this program, begun anew with an option that nobody else uses. A file that
// was cut, changed or forged can end the library that reads it, or have it ask for all memory; then only that process ends, and the
// file is refused. It has limits of memory and time, no core dump, and dies with the process that began it.

#include <string>

#include "core/detection/network_detector.h"

namespace alidade {

inline constexpr const char* kNetworkTrial = "--try-network";

// By main(), in the program that knows the option.
void allow_network_trials();

// False with one line: what the detector said of it, or how it ended. True too where no process can be begun.
[[nodiscard]] bool survives_trial(const std::string& model, const NetworkOptions& options,
                                  std::string* error);

// The other end: the model is stdin, what is said of it goes to stdout.
int run_network_trial(int argc, char** argv);

}  // namespace alidade
