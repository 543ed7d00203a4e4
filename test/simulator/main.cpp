// alidade-simulate: a virtual PTZ camera with known truth. With -o it writes a recording, without it
// serves real RTSP/RTP video and VAPIX pan/tilt on loopback. See README.md.
// Exit codes: 0 done, 1 failed, 2 bad usage or configuration.

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <string>

#include "test/simulator/config.h"
#include "test/simulator/live.h"
#include "test/simulator/recording_writer.h"

namespace {

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_requested = true; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

int run(int argc, char** argv) {
  CLI::App app("A virtual pan-tilt-zoom camera with known truth.");
  std::string config_file;
  std::string output;
  app.add_option("-c,--config", config_file, "configuration (YAML)")->required();
  app.add_option("-o,--output", output,
                 "write a recording to this new directory; without it, serve");
  app.set_version_flag("--version", "alidade-simulate " ALIDADE_VERSION);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::fprintf(stderr, "alidade-simulate: %s (see --help)\n", error.what());
    return 2;
  }

  using namespace alidade::simulator;
  const Config config = load_config(config_file);
  if (output.empty()) {
    stop_on_signals();
    serve_live(config, stop_requested);
  } else {
    write_recording(config, output);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const alidade::simulator::ConfigError& error) {
    std::fprintf(stderr, "alidade-simulate: %s\n", error.what());
    return 2;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "alidade-simulate: %s\n", error.what());
    return 1;
  }
}
