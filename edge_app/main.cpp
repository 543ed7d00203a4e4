// The program `alidade`. Results go to stdout or to files. The log and the one-line errors go to
// stderr.

#include <signal.h>

#include <cstring>
#include <exception>

#include "edge_app/commands/command.h"
#include "edge_app/commands/command_line.h"
#include "edge_app/commands/log.h"
#include "edge_app/commands/network_trial.h"

int main(int argc, char** argv) {
  try {
    signal(SIGPIPE, SIG_IGN);  // if the reader is gone, write(2) fails instead
    alidade::start_log();
    if (argc > 1 && std::strcmp(argv[1], alidade::kNetworkTrial) == 0)
      return alidade::run_network_trial(argc, argv);
    alidade::allow_network_trials();
    return alidade::run_command_line(argc, argv);
  } catch (const std::exception& e) {
    alidade::print_error(e.what());
  } catch (...) {
    alidade::print_error("unknown failure");
  }
  return alidade::kExitFailed;
}
