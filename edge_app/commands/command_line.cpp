#include "edge_app/commands/command_line.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <string>

#include "edge_app/commands/calibrate.h"
#include "edge_app/commands/check.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/record.h"
#include "edge_app/commands/replay.h"
#include "edge_app/commands/run.h"

namespace alidade {
namespace {

void add_run(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command =
      app.add_subcommand("run", "Live: an orientation for each video frame, on stdout");
  command->add_option("-c,--config", options->config, "Configuration (YAML)")->required();
  command->add_option("--duration", options->duration_s, "End after so many seconds")
      ->check(CLI::PositiveNumber);
  CLI::Option* json =
      command->add_flag("--json", options->json, "JSON Lines, whatever the configuration says");
  command->add_flag("--csv", options->csv, "CSV, whatever the configuration says")->excludes(json);
  command->callback([options, exit_code] { *exit_code = run_live(*options); });
}

void add_record(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<RecordOptions>();
  CLI::App* command = app.add_subcommand(
      "record", "Store the live streams as a recording (video copied, not re-encoded)");
  command->add_option("-c,--config", options->config, "Configuration (YAML)")->required();
  command->add_option("-o,--output", options->directory, "Directory of the new recording")
      ->required();
  command->add_option("--duration", options->duration_s, "End after so many seconds")
      ->check(CLI::PositiveNumber);
  command->callback([options, exit_code] { *exit_code = record_streams(*options); });
}

void add_replay(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<ReplayOptions>();
  CLI::App* command = app.add_subcommand(
      "replay", "Run the real-time modes over a recording; writes orientation.csv");
  command->add_option("recording", options->recording, "Directory of the recording")->required();
  command->add_option("-o,--output", options->directory,
                      "Directory for orientation.csv (default: DIR/alidade)");
  command->add_option("--calibration", options->calibration,
                      "Calibration (default: DIR/alidade/calibration.yaml)");
  command
      ->add_option("--mode", options->mode,
                   "OE or PT (default: OE if the recording has pictures, PT if not)")
      ->check(CLI::IsMember({"OE", "PT"}));
  command->add_flag("--realtime", options->realtime, "At the pace of the recording");
  CLI::Option* json = command->add_flag("--json", options->json, "Also on stdout, as JSON Lines");
  command->add_flag("--csv", options->csv, "Also on stdout, as CSV")->excludes(json);
  command->footer(
      "Reads no configuration: how long telemetry is extrapolated and a repeated angle trusted is "
      "the default of "
      "realtime.max_extrapolation_s and pan_tilt.max_repeat_s, whatever they were live. With those "
      "of a configuration: "
      "alidade run, with video and pan_tilt of type recording.");
  command->callback([options, exit_code] { *exit_code = replay_recording(*options); });
}

void add_calibrate(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<CalibrateOptions>();
  CLI::App* command =
      app.add_subcommand("calibrate",
                         "Calibrate from a recording's video (or tracks.csv) and telemetry; writes "
                         "calibration.yaml, map.bin and report.html");
  command->add_option("recording", options->recording, "Directory of the recording")->required();
  command->add_option("-o,--output", options->directory,
                      "Directory for the results (default: DIR/alidade)");
  command->add_flag("--json", options->json, "The result on stdout as one line of JSON");
  command
      ->add_option(
          "--passes", options->passes,
          "Video without tracks.csv: look once (1), or again with the estimated camera (2)")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  const char* group = "What is known beforehand: VALUE (exact), VALUE,SIGMA, or free";
  const auto add_prior = [&](const char* name, std::string* text, const char* help) {
    command->add_option(name, *text, help)->group(group)->type_name("PRIOR");
  };
  add_prior("--focal-length", &options->focal_length, "px (default: free)");
  add_prior("--aspect", &options->aspect, "f_v / f_u (default: 1, square pixels)");
  add_prior("--radial-distortion", &options->radial_distortion, "(default: free)");
  add_prior("--line-delay", &options->line_delay, "s/row (default: free)");
  add_prior("--clock-offset", &options->clock_offset, "s (default: free)");
  command
      ->add_option("--scale-sigma", options->scale_sigma,
                   "How well measured angles are known to be true angles, relative (default: "
                   "noise.yaml's pan_tilt_scale_sigma, or 1e-8)")
      ->check(CLI::Range(0.0, 1.0))
      ->group(group);
  command->callback([options, exit_code] { *exit_code = calibrate_recording(*options); });
}

void add_check(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* command = app.add_subcommand(
      "check", "Validate the configuration, try each connection, and measure what comes");
  command->add_option("-c,--config", options->config, "Configuration (YAML)")->required();
  command->add_option("--duration", options->duration_s, "Seconds to measure each stream for")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->callback([options, exit_code] { *exit_code = check_links(*options); });
}

}  // namespace

int run_command_line(int argc, char** argv) {
  CLI::App app("Turns a pan-tilt-zoom camera into a precise direction sensor", "alidade");
  app.set_version_flag("--version", std::string("alidade ") + ALIDADE_VERSION);
  app.require_subcommand(1);
  app.fallthrough();  // --version after a sub-command too
  int exit_code = kExitOk;
  add_run(app, &exit_code);
  add_record(app, &exit_code);
  add_replay(app, &exit_code);
  add_calibrate(app, &exit_code);
  add_check(app, &exit_code);
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

}  // namespace alidade
