#pragma once
// `alidade check`. The command line (command_line.cpp) names the options as here and checks them.

#include <string>

#include "core/model/recording_needs.h"

namespace alidade {

struct CheckOptions {
  std::string config;                 // path of alidade.yaml
  double duration_s = kCheckAsked_s;  // from the first item of each link on
  bool json = false;
};

// Checks the configuration and what its links send. Returns the exit code: kExitFailed if a finding
// is a problem. Throws CommandError if nothing can be measured: the configuration, or a
// calibration, plane, lens.yaml or network that it names, cannot be used.
[[nodiscard]] int check_links(const CheckOptions& options);

}  // namespace alidade
