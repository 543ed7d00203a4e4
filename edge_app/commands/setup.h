#pragma once
// `alidade setup`: `alidade discover` as a page in the browser. Serves 127.0.0.1 only, and only who
// has the address with its token, as others may be logged in at this machine.

#include <string>

namespace alidade {

struct SetupOptions {
  std::string write = "camera.yaml";
  int port = 8099;  // 0: any free one
};

// Serves until a signal. Returns the exit code; throws CommandError.
[[nodiscard]] int set_up_in_browser(const SetupOptions& options);

}  // namespace alidade
