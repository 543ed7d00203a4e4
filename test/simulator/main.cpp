// alidade-simulate: a virtual PTZ camera with known truth. With -o it writes a recording, without it
// serves real RTSP/RTP video and VAPIX pan/tilt on loopback. See README.md.
// Exit codes: 0 done, 1 failed, 2 bad usage or configuration.

#include <CLI/CLI.hpp>
#include <atomic>
#include <csignal>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <optional>
#include <string>

#include "test/simulator/config.h"
#include "test/simulator/live.h"
#include "test/simulator/recording_writer.h"
#include "test/simulator/resize.h"

namespace {

std::atomic<bool> stop_requested{false};
static_assert(std::atomic<bool>::is_always_lock_free, "set by a signal handler");

void stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_requested = true; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

namespace fs = std::filesystem;

// The examples of the package lie beside its program, those of a build in its source folder.
fs::path example_file(const std::string& name) {
  const fs::path here = fs::read_symlink("/proc/self/exe").parent_path();
  const std::string file = name == "cheap_dome" ? "cheap_dome.yaml" : name + "_camera.yaml";
  for (const fs::path& folder : {here / "../share/alidade-simulator/simulator/examples",
                                 here / "../../../../test/simulator/examples"}) {
    if (fs::exists(folder / file)) return (folder / file).lexically_normal();
  }
  throw alidade::simulator::ConfigError(
      "--example: the examples are not where the program is installed; give -c FILE");
}

int run(int argc, char** argv) {
  CLI::App app("A virtual pan-tilt-zoom camera with known truth.");
  std::string config_file;
  std::string output;
  CLI::Option* config_option = app.add_option("-c,--config", config_file,
                                              "configuration (YAML); this or --example is needed");
  std::string example;
  app.add_option("--example", example,
                 "a camera that comes with the program: tutorial, paper, zoom or cheap_dome; its "
                 "truth goes to the folder truth here")
      ->check(CLI::IsMember({"tutorial", "paper", "zoom", "cheap_dome"}))
      ->excludes(config_option);
  std::string size;
  app.add_option(
      "--size", size,
      "WIDTHxHEIGHT of the pictures in place of the configuration's, as 480x270: smaller "
      "ones are rendered sooner");
  std::optional<double> duration;
  app.add_option("--duration", duration,
                 "seconds in place of the configuration's; 0: serve without end what repeats")
      ->check(CLI::Range(0.0, 1e6));
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
  if (config_file.empty() && example.empty())
    throw ConfigError("a camera is missing; give -c FILE, or --example zoom");
  Config config = load_config(example.empty() ? fs::path(config_file) : example_file(example));
  // The folder of the examples may not be written.
  if (!example.empty()) config.truth_dir = "truth";
  if (!size.empty()) resize(size, &config);
  if (duration) config.duration = *duration;
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
