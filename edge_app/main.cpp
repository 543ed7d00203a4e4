// alidade: the command line. Results go to stdout or files; the log and one-line errors to stderr.

#include <signal.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>

#include "edge_app/commands/command.h"

namespace {

int run_command_line(int argc, char** argv) {
  using namespace alidade;
  CLI::App app("Turns a pan-tilt-zoom camera into a precise direction sensor", "alidade");
  app.set_version_flag("--version", std::string("alidade ") + ALIDADE_VERSION);
  app.require_subcommand(1);
  app.fallthrough();  // --version after a sub-command too
  int exit_code = kExitOk;
  register_run(app, &exit_code);
  register_record(app, &exit_code);
  register_replay(app, &exit_code);
  register_calibrate(app, &exit_code);
  register_check(app, &exit_code);
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return app.exit(e);  // --help, --version
    }
    std::fprintf(stderr, "alidade: %s; see alidade --help\n", e.what());
    return kExitUsage;
  } catch (const CommandError& e) {
    std::fprintf(stderr, "alidade: %s\n", e.what());
    return e.exit_code;
  }
}

}  // namespace

int main(int argc, char** argv) {
  try {
    signal(SIGPIPE, SIG_IGN);  // a reader that goes away is an error of write(2)
    spdlog::set_default_logger(spdlog::stderr_color_mt("alidade"));
    spdlog::set_pattern("%H:%M:%S.%e %^%l%$ %v");
    return run_command_line(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "alidade: %s\n", e.what());
  } catch (...) {
    std::fprintf(stderr, "alidade: unknown failure\n");
  }
  return alidade::kExitFailed;
}
