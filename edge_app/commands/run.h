#pragma once
// `alidade run`. The command line (command_line.cpp) names the options as here and checks them.

#include <limits>
#include <string>

namespace alidade {

struct RunOptions {
  std::string config;                                           // path of alidade.yaml
  double duration_s = std::numeric_limits<double>::infinity();  // infinite: until a signal
  bool json = false;
  bool csv = false;
};

// Writes a record for each live video frame until a signal or the end of the duration. Returns
// kExitOk. Throws CommandError if the configuration or a file that it names cannot be used, the
// HTTP server or a thread cannot be started, a link fails for good, frames have another size than
// the calibration, or records cannot be written. It is no error if the reader of stdout merely went
// away.
[[nodiscard]] int run_live(const RunOptions& options);

}  // namespace alidade
