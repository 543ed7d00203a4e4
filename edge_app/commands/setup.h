#pragma once
// `alidade setup`: `alidade discover` as a page in the browser. Serves 127.0.0.1 only. All but the
// page itself needs the token in the printed address, as others may be logged in at this machine.

#include <string>

namespace alidade {

struct SetupOptions {
  std::string write = "camera.yaml";
  int port = 8099;  // 0: any free one
};

// Serves until SIGINT or SIGTERM. Returns kExitOk. Throws CommandError if the configuration to
// write exists already, or if the server cannot be started.
[[nodiscard]] int set_up_in_browser(const SetupOptions& options);

}  // namespace alidade
