#include "edge_app/commands/command_line.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/model/recording_needs.h"
#include "edge_app/commands/calibrate.h"
#include "edge_app/commands/calibrate_shutter.h"
#include "edge_app/commands/check.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/discover.h"
#include "edge_app/commands/live_pattern.h"
#include "edge_app/commands/localize.h"
#include "edge_app/commands/log.h"
#include "edge_app/commands/map_build.h"
#include "edge_app/commands/map_export.h"
#include "edge_app/commands/map_info.h"
#include "edge_app/commands/option_checks.h"
#include "edge_app/commands/plane.h"
#include "edge_app/commands/record.h"
#include "edge_app/commands/replay.h"
#include "edge_app/commands/run.h"
#include "edge_app/commands/setup.h"
#include "edge_app/commands/verify.h"
#include "edge_app/config/nearest_word.h"

namespace alidade {
namespace {

void add_discover(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<DiscoverOptions>();
  CLI::App* command = app.add_subcommand(
      "discover", "Find cameras, on the network and on this machine; writes a configuration");
  command
      ->add_option(
          "--device", options->device,
          "The camera that is meant: its address (192.0.2.10, http://192.0.2.10:8080, also "
          "one that the search does not reach), or /dev/video0 (default: the only one)")
      ->type_name("DEVICE");
  CLI::Option* user = command->add_option(
      "--user", options->user, "Log in at that camera; its password is asked for without echo");
  command
      ->add_option("--password-file", options->password_file,
                   "A file whose first line is the password, in place of the question")
      ->needs(user);
  CLI::Option* write = command->add_option(
      "--write", options->write,
      "Try the camera and write its configuration; the password goes to a file of its own beside "
      "it, for its owner only");
  command
      ->add_option("--field-of-view", options->field_of_view,
                   "Of the lens, horizontally, from the data sheet; WIDE:TELE of one that zooms")
      ->type_name("DEG")
      ->needs(write);
  command
      ->add_option("--head", options->head,
                   "A head of its own in place of the camera's telemetry, TYPE:ADDRESS: "
                   "pelco_d:/dev/ttyUSB0, ptu:tcp://192.0.2.7:4000")
      ->type_name("HEAD")
      ->needs(write);
  command
      ->add_option("--set", options->keys,
                   "A key of the configuration: SECTION.KEY=VALUE, as pan_tilt.pan_positive=left; "
                   "may be given several times")
      ->type_name("KEY")
      ->allow_extra_args(false)
      ->needs(write);
  command->add_flag("--untried", options->untried, "Write it without trying video and telemetry")
      ->needs(write);
  command->add_option("--interface", options->interface,
                      "Search on this network interface only (default: on all)");
  command
      ->add_option("--duration", options->duration_s,
                   "Seconds to search the network for; 0: not at all")
      ->check(CLI::Range(0.0, 600.0))
      ->capture_default_str();
  command->add_flag("--json", options->json, "What was found on stdout as one line of JSON");
  command->callback([options, exit_code] { *exit_code = discover_cameras(*options); });
}

void add_setup(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<SetupOptions>();
  CLI::App* command = app.add_subcommand(
      "setup",
      "The same as a page in the browser, on this machine or by ssh; writes a configuration");
  command->add_option("--write", options->write, "The configuration to write")
      ->capture_default_str();
  command->add_option("--port", options->port, "Port on 127.0.0.1; 0: any free one")
      ->check(CLI::Range(0, 65535))
      ->capture_default_str();
  command->callback([options, exit_code] { *exit_code = set_up_in_browser(*options); });
}

constexpr const char* kNoConfiguration =
    "-c is missing: the configuration. To make one: alidade setup (in a browser), or alidade "
    "discover --write camera.yaml";

void add_run(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command =
      app.add_subcommand("run", "Live: an orientation for each video frame, on stdout");
  command->add_option("-c,--config", options->config, "Configuration (YAML), required");
  command->add_option("--duration", options->duration_s, "End after so many seconds")
      ->check(is_duration);
  CLI::Option* json =
      command->add_flag("--json", options->json, "JSON Lines, whatever the configuration says");
  command->add_flag("--csv", options->csv, "CSV, whatever the configuration says")->excludes(json);
  command->callback([options, exit_code] {
    if (options->config.empty()) throw CommandError(kExitUsage, kNoConfiguration);
    *exit_code = run_live(*options);
  });
}

void add_record(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<RecordOptions>();
  CLI::App* command = app.add_subcommand(
      "record", "Store the live streams as a recording (video copied, not re-encoded)");
  command->add_option("-c,--config", options->config, "Configuration (YAML)")->required();
  command->add_option("-o,--output", options->directory, "Directory of the new recording")
      ->required();
  command
      ->add_option("--duration", options->duration_s,
                   "End so many seconds after the first frame that is stored")
      ->check(is_duration);
  command->callback([options, exit_code] { *exit_code = record_streams(*options); });
}

void add_zoom_tolerance(CLI::App* command, std::optional<double>* tolerance) {
  command
      ->add_option("--zoom-tolerance", *tolerance,
                   "Zoom readings up to this far apart are one zoom, in units of the device "
                   "(default: found from their jitter)")
      ->check(CLI::NonNegativeNumber);
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
  add_zoom_tolerance(command, &options->zoom_tolerance);
  CLI::Option* detections = command->add_option(
      "--detections", options->detections,
      "What a detector found in the frames: JSON Lines as POST /api/v1/detections has them, or - "
      "for stdin; writes targets.jsonl");
  command
      ->add_option("--tracking", options->tracking,
                   "Configuration whose section tracking is used for them (default: directions, "
                   "without a plane)")
      ->needs(detections);
  command->add_flag("--realtime", options->realtime, "At the pace of the recording");
  CLI::Option* json = command->add_flag("--json", options->json, "Also on stdout, as JSON Lines");
  command->add_flag("--csv", options->csv, "Also on stdout, as CSV")->excludes(json);
  command->footer(
      "Reads no configuration: realtime.max_extrapolation_s and pan_tilt.max_repeat_s have their "
      "defaults, whatever they were live. To use a configuration: alidade run, with video and "
      "pan_tilt of type recording.");
  command->callback([options, exit_code] { *exit_code = replay_recording(*options); });
}

void add_verify(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<VerifyOptions>();
  CLI::App* command = app.add_subcommand(
      "verify",
      "How good a calibration is on a recording, by places that are seen again; writes "
      "verification.html");
  command->add_option("recording", options->recording, "Directory of the recording")->required();
  command->add_option("--calibration", options->calibration,
                      "Calibration (default: DIR/alidade/calibration.yaml)");
  CLI::Option* known =
      command->add_option("--known", options->known,
                          "Directions known from outside: a table of frame,u_px,v_px,azimuth_deg,"
                          "elevation_deg,sigma_deg");
  const auto add_turn = [&](const char* name, std::string* text, const char* help) {
    command->add_option(name, *text, help)->type_name("DEG")->check(is_turn_sigma)->needs(known);
  };
  add_turn("--heading-sigma", &options->heading_sigma,
           "Of the platform's heading in their axes, or free: it is estimated (default: 0, as "
           "stated)");
  add_turn("--level-sigma", &options->level_sigma, "Likewise of its roll and pitch");
  command->add_option("-o,--output", options->directory,
                      "Directory for verification.html (default: DIR/alidade)");
  add_zoom_tolerance(command, &options->zoom_tolerance);
  command->add_flag("--json", options->json, "The result on stdout as one line of JSON");
  command->footer(
      fmt::format("Exit status: 0 the sigmas hold, 1 they are contradicted, 2 nothing could be "
                  "judged. Record for {:g} s while the head pans and tilts over {:g} field of view "
                  "or more, to and fro, at several speeds.",
                  kVerificationAsked_s, kVerificationRangeAsked));
  command->callback([options, exit_code] { *exit_code = verify_calibration(*options); });
}

void add_calibrate(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<CalibrateOptions>();
  CLI::App* command =
      app.add_subcommand("calibrate",
                         "Calibrate from a recording's video (or tracks.csv) and telemetry; writes "
                         "calibration.yaml, map.bin and report.html");
  command
      ->add_option("recording", options->recordings,
                   "Directory of the recording. Several, or one that dwells at several zooms, give "
                   "one calibration for all zooms between")
      ->required();
  command->add_option("-o,--output", options->directory,
                      "Directory for the results (default: DIR/alidade of the first recording)");
  add_zoom_tolerance(command, &options->zoom_tolerance);
  command->add_flag("--json", options->json, "The result on stdout as one line of JSON");
  command
      ->add_option(
          "--passes", options->passes,
          "Video without tracks.csv: look once (1), or again with the estimated camera (2)")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  command
      ->add_option(
          "--prior", options->prior,
          "lens.yaml of alidade calibrate-shutter: its line delay is valid at any zoom, its focal "
          "length and distortion at its own zoom only; the options below replace its values")
      ->type_name("FILE");
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
                   "Relative sigma of the scale from true to measured angles (default: "
                   "noise.yaml's pan_tilt_scale_sigma, or 1e-8)")
      ->check(is_share)
      ->group(group);
  command
      ->add_option("--centre-sigma", options->centre_sigma_px,
                   "px; how far the optical centre may be from the picture's middle, one sigma; 0: "
                   "it is the middle (default: 1 % of the width)")
      ->check(is_length_px)
      ->group(group);
  command
      ->add_option("--angle-accuracy", options->angle_accuracy_deg,
                   "The maker's claim of telemetry's angles, deg (default: noise.yaml's "
                   "pan_tilt_accuracy_rad, or none): the focal length is known to no better than "
                   "this over the range of pan")
      ->check(is_accuracy)
      ->group(group);
  command
      ->add_option("--scene-distance", options->scene_distance_m,
                   "NEAREST,FARTHEST, m; how far away what is in view is (default: nothing is "
                   "known): the focal length's sigma covers far things, and theirs is told, too")
      ->delimiter(',')
      ->expected(2)
      ->type_name("METRES")
      ->check(is_scene_distance)
      ->group(group);
  command
      ->add_option("--pupil", options->pupil_m,
                   "RIGHT,DOWN,FORWARD, m; the lens's entrance pupil from where pan and tilt axis "
                   "meet (default: 0, one sigma 0.05)")
      ->delimiter(',')
      ->expected(3)
      ->type_name("METRES")
      ->check(is_pupil_place)
      ->group(group);
  command->callback([options, exit_code] { *exit_code = calibrate_recordings(*options); });
}

void add_calibrate_shutter(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<CalibrateShutterOptions>();
  CLI::App* command = app.add_subcommand(
      "calibrate-shutter",
      "Line delay and lens from a video of a known pattern, stored or live; writes lens.yaml, "
      "camera_info.yaml, trajectory.csv and report.html");
  command->add_option("video", options->video, "Directory of a recording, or a video file");
  command->add_option(
      "-c,--config", options->config,
      "Configuration (YAML) of a live camera in place of a video; its video section "
      "is enough");
  command
      ->add_option("--duration", options->duration_s,
                   "Live: end after so many seconds (default: 60), or before, when all was shown")
      ->check(is_film_duration);
  command
      ->add_option("--pattern", options->pattern,
                   "chessboard:9x6:25mm (inner corners, square), circles:4x11:20mm, "
                   "symmetric-circles:7x6:20mm, aprilgrid:6x6:30mm:0.3 or charuco:9x6:30mm:22mm "
                   "(squares; a square's and a marker's side; then :DICTIONARY, if it is not "
                   "4x4_50)")
      ->required();
  command->add_option("--print", options->paper,
                      "Draw the pattern in true size, as SVG on stdout, for a4, a3, a2, a1, a0 or "
                      "letter");
  command->add_option("-o,--output", options->directory,
                      "Directory for the results (default: alidade in the recording or beside the "
                      "file; live: in the current folder)");
  command->add_flag("--json", options->json, "The result on stdout as one line of JSON");
  command->footer(
      "Move the camera before the pattern for some 30 s: show it whole, tilted to all sides, near "
      "and "
      "far, and shake the camera a little, so that the image moves while it is read out.");
  command->callback([options, exit_code] { *exit_code = calibrate_shutter(*options); });
}

void add_plane(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<PlaneOptions>();
  CLI::App* command = app.add_subcommand(
      "plane", "The ground under the camera, from what is known of it; writes plane.yaml");
  command->add_option("action", options->action, "What to do: fit")
      ->required()
      ->check(CLI::IsMember({"fit"}));
  command
      ->add_option(
          "data", options->data,
          "What is known (YAML): heights, level, points, horizon, lengths, upright targets")
      ->required();
  command->add_option("-o,--output", options->output,
                      "File for the result (default: plane.yaml beside the data)");
  command->add_flag("--json", options->json, "The result on stdout as one line of JSON");
  command->callback([options, exit_code] { *exit_code = fit_plane_command(*options); });
}

void add_check(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<CheckOptions>();
  CLI::App* command = app.add_subcommand(
      "check", "Validate the configuration, try each connection, and measure what comes");
  command->add_option("-c,--config", options->config, "Configuration (YAML)")->required();
  command->add_option("--duration", options->duration_s, "Seconds to measure each stream for")
      ->check(is_duration)
      ->capture_default_str();
  command->add_flag("--json", options->json, "The report on stdout as one line of JSON");
  command->callback([options, exit_code] { *exit_code = check_links(*options); });
}

void add_map_build(CLI::App& map, int* exit_code) {
  auto options = std::make_shared<MapBuildCommand>();
  CLI::App* command =
      map.add_subcommand("build", "A scene map from recordings: all that was seen at all zooms");
  command->add_option("recording", options->recordings, "Directories of recordings")->required();
  command->add_option("-o,--output", options->map, "File of the map")->required();
  command->add_option("--add", options->add,
                      "A map whose pictures the new one takes over; both may be the same file");
  command->add_option("--calibration", options->calibration,
                      "Calibration (default: alidade/calibration.yaml in the first recording, if "
                      "it is there)");
  command
      ->add_option("--focal-length", options->focal_length,
                   "px, from a data sheet; WIDE:TELE at the least and the greatest zoom reading")
      ->type_name("PX");
  command->add_option("--keyframes", options->keyframes, "Pictures to keep at most")
      ->check(CLI::Range(2, 2000))
      ->capture_default_str();
  command->add_flag("--no-telemetry", options->no_telemetry,
                    "By the pictures alone, and the zoom readings");
  command->add_flag("--largest-part", options->largest_part,
                    "If the pictures make several unconnected parts, take the largest");
  command->add_flag("--json", options->json, "The result on stdout as one line of JSON");
  command->callback([options, exit_code] { *exit_code = build_map(*options); });
}

void add_map(CLI::App& app, int* exit_code) {
  CLI::App* map = app.add_subcommand("map", "Build, show, check or export a scene map");
  map->require_subcommand(1);
  add_map_build(*map, exit_code);
  using Show = int (*)(const MapInfoCommand&);
  const auto add_show = [&](const char* name, const char* help, Show show) {
    auto options = std::make_shared<MapInfoCommand>();
    CLI::App* command = map->add_subcommand(name, help);
    command->add_option("map", options->map, "File of the map")->required();
    command->add_flag("--json", options->json, "On stdout as one line of JSON");
    command->callback([options, exit_code, show] { *exit_code = show(*options); });
  };
  add_show("info", "What a scene map holds", show_map);
  add_show("check", "Whether a scene map is whole and does not contradict itself", check_map);
  auto options = std::make_shared<MapExportCommand>();
  CLI::App* command = map->add_subcommand(
      "export", "keyframes.csv, the keyframes' pictures and panorama.png of a scene map");
  command->add_option("map", options->map, "File of the map")->required();
  command->add_option("-o,--output", options->directory, "Directory for them")->required();
  command->callback([options, exit_code] { *exit_code = export_map(*options); });
}

void add_localize(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<LocalizeCommand>();
  CLI::App* command =
      app.add_subcommand("localize", "Where pictures look, by a scene map; JSON Lines on stdout");
  command->add_option("map", options->map, "File of the map")->required();
  command
      ->add_option("picture", options->pictures, "Files of pictures, and directories of recordings")
      ->required();
  command->add_option("--calibration", options->calibration,
                      "Of a recording: gives the focal length for each zoom reading");
  command->add_flag("--no-telemetry", options->no_telemetry,
                    "By the pictures alone, and the zoom readings");
  command->add_option("--every", options->every, "Of a recording's frames, use every so many")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->callback([options, exit_code] { *exit_code = localize_pictures(*options); });
}

std::vector<std::string> command_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands({})) names.push_back(command->get_name());
  return names;
}

std::vector<std::string> option_names(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
    for (const std::string& name : option->get_snames()) names.push_back("-" + name);
  }
  return names;
}

// The chosen sub-commands from the outermost to the innermost: "map", "build".
std::vector<const CLI::App*> chosen_commands(const CLI::App& app) {
  std::vector<const CLI::App*> chosen;
  const CLI::App* above = &app;
  for (;;) {
    const std::vector<CLI::App*> next = above->get_subcommands();
    if (next.empty()) return chosen;
    above = next.front();
    chosen.push_back(above);
  }
}

// A message about the first word that is neither a command nor an option of the chosen command.
// Empty if there is none. The library would complain first about a missing required option,
// although the option was only mistyped.
std::string unknown_word(const CLI::App& app, const std::vector<std::string>& words) {
  const std::vector<std::string> unknown = app.remaining(true);
  const std::vector<const CLI::App*> chosen = chosen_commands(app);
  const CLI::App& above = chosen.empty() ? app : *chosen.back();
  for (const std::string& word : words) {
    if (std::find(unknown.begin(), unknown.end(), word) == unknown.end()) continue;
    if (word.size() > 1 && word.front() == '-') {
      std::vector<std::string> known = option_names(app);
      for (const CLI::App* command : chosen) {
        const std::vector<std::string> more = option_names(*command);
        known.insert(known.end(), more.begin(), more.end());
      }
      const std::string name = word.substr(0, word.find('='));
      return fmt::format("unknown option '{}'{}", name, did_you_mean(name, known));
    }
    const std::vector<std::string> known = command_names(above);
    if (known.empty()) continue;
    return nearest_word(word, known)
               ? fmt::format("unknown command '{}'{}", word, did_you_mean(word, known))
               : fmt::format("unknown command '{}'; expected one of {}", word,
                             fmt::join(known, ", "));
  }
  return "";
}

// One line: what is wrong, and which help to read.
std::string usage_error(const CLI::App& app, const std::vector<std::string>& words,
                        const CLI::ParseError& error) {
  std::string what = unknown_word(app, words);
  if (what.empty()) what = error.what();
  std::string command;
  for (const CLI::App* each : chosen_commands(app)) command += each->get_name() + " ";
  return fmt::format("{}; see alidade {}--help", what, command);
}

}  // namespace

int run_command_line(int argc, char** argv) {
  CLI::App app("Turns a pan-tilt-zoom camera into a precise direction sensor", "alidade");
  app.set_version_flag("--version", std::string("alidade ") + ALIDADE_VERSION);
  app.require_subcommand(1);
  app.fallthrough();  // allows --version after a sub-command
  int exit_code = kExitOk;
  add_discover(app, &exit_code);
  add_setup(app, &exit_code);
  add_run(app, &exit_code);
  add_record(app, &exit_code);
  add_replay(app, &exit_code);
  add_verify(app, &exit_code);
  add_calibrate(app, &exit_code);
  add_calibrate_shutter(app, &exit_code);
  add_plane(app, &exit_code);
  add_check(app, &exit_code);
  add_map(app, &exit_code);
  add_localize(app, &exit_code);
  try {
    app.parse(argc, argv);
    return exit_code;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == static_cast<int>(CLI::ExitCodes::Success)) {
      return app.exit(e);  // --help, --version
    }
    print_error(usage_error(app, {argv + 1, argv + argc}, e));
    return kExitUsage;
  } catch (const CommandError& e) {
    print_error(e.what());
    return e.exit_code;
  }
}

}  // namespace alidade
