// alidade: the program. Results go to stdout or files; the log and one-line errors to stderr.

#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <exception>

#include "edge_app/commands/command.h"
#include "edge_app/commands/command_line.h"

int main(int argc, char** argv) {
  try {
    signal(SIGPIPE, SIG_IGN);  // a reader that goes away is an error of write(2)
    spdlog::set_default_logger(spdlog::stderr_color_mt("alidade"));
    spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");
    return alidade::run_command_line(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "alidade: %s\n", e.what());
  } catch (...) {
    std::fprintf(stderr, "alidade: unknown failure\n");
  }
  return alidade::kExitFailed;
}
