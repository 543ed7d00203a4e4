#include "edge_app/config/config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "edge_app/config/link_keys.h"
#include "edge_app/config/yaml_section.h"
#include "edge_app/output/http/http_tokens.h"
#include "platform/streams/picture_size.h"
#include "platform/system/file_stamp.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

constexpr NumberRange kFocalLengths{1, 1e8, "px"};

FocalLengthRange read_focal_lengths(YamlSection section) {
  const auto end = [&section](const char* key) {
    const std::optional<double> value = section.number(key, kFocalLengths);
    if (!value)
      section.fail_missing(key, "give wide and tele, px, or one number for a lens of one zoom");
    return *value;
  };
  const FocalLengthRange range{end("wide"), end("tele")};
  if (!(range.wide_px < range.tele_px)) {
    section.fail("tele",
                 fmt::format("is {:g} px and wide is {:g} px; wide is the shorter of the two",
                             range.tele_px, range.wide_px));
  }
  section.finish();
  return range;
}

CameraConfig read_camera(YamlSection section) {
  CameraConfig camera;
  if (section.is_section("focal_length_px")) {
    const FocalLengthRange range = read_focal_lengths(section.section("focal_length_px"));
    camera.focal_length_range = range;
    camera.focal_length_px = std::sqrt(range.wide_px * range.tele_px);
  } else {
    camera.focal_length_px = section.number("focal_length_px", kFocalLengths);
  }
  camera.aspect = section.number("aspect", {0.5, 2, "1"}).value_or(camera.aspect);
  camera.radial_distortion =
      section.number("radial_distortion", {-1e8, 1e8, "1"}).value_or(camera.radial_distortion);
  camera.centre_sigma_px = section.number("centre_sigma_px", {0, 1e4, "px"});
  if (const auto place = section.numbers("pupil_m", 3, {-kFarthestPupil_m, kFarthestPupil_m, "m"}))
    camera.pupil = {Vector3<double>(place->data()), Vector3<double>::Constant(kStatedPupilSigma_m)};
  camera.line_delay_s =
      section.number("line_delay_s", {-1e-3, 1e-3, "s/row"}).value_or(camera.line_delay_s);
  camera.upside_down = section.truth("upside_down").value_or(camera.upside_down);
  static_cast<void>(section.choice("zoom", {"fixed"}));
  section.finish();
  return camera;
}

std::optional<SceneDistance> read_scene(YamlSection section) {
  constexpr NumberRange kDistances{kNearestScene_m, 1e9, "m"};
  const std::optional<double> nearest = section.number("nearest_m", kDistances);
  const std::optional<double> farthest = section.number("farthest_m", kDistances);
  section.finish();
  if (!nearest && !farthest) return std::nullopt;
  if (!nearest) section.fail_missing("nearest_m", "give how near the nearest thing in view is, m");
  SceneDistance scene{*nearest};
  if (farthest) scene.farthest_m = *farthest;
  if (!(scene.nearest_m < scene.farthest_m)) {
    section.fail("farthest_m", fmt::format("is {:g} m and nearest_m is {:g} m; farthest_m is the "
                                           "larger of the two",
                                           scene.farthest_m, scene.nearest_m));
  }
  return scene;
}

CalibrationConfig read_calibration(YamlSection section, const std::string& path) {
  CalibrationConfig calibration;
  if (const auto file = section.text("file")) calibration.file = path_relative_to(path, *file);
  if (const auto prior = section.text("prior")) calibration.prior = path_relative_to(path, *prior);
  calibration.automatic = section.truth("auto").value_or(calibration.automatic);
  calibration.zoom_tolerance = section.number("zoom_tolerance", {0, 1e6, "units of the device"});
  if (const auto sigma_ms = section.number("clock_offset_sigma_ms", {0, 1000, "ms"}))
    calibration.clock_offset_sigma_s = 1e-3 * *sigma_ms;
  section.finish();
  return calibration;
}

SceneMapConfig read_scene_map(YamlSection section, const std::string& path) {
  SceneMapConfig scene_map;
  if (const auto file = section.text("file")) scene_map.file = path_relative_to(path, *file);
  scene_map.interval_s = section.number("interval_s", kSeconds).value_or(scene_map.interval_s);
  scene_map.zero_sigma_rad =
      section.number("zero_sigma_rad", {1e-7, 0.5, "rad"}).value_or(scene_map.zero_sigma_rad);
  scene_map.update = section.truth("update").value_or(scene_map.update);
  if (scene_map.update && scene_map.file.empty())
    section.fail("update", "is true, but there is no map to update; add file");
  scene_map.correct_moved_base =
      section.choice("on_moved_base", {"correct", "report"}).value_or("correct") == "correct";
  section.finish();
  return scene_map;
}

// Four polls of a slow link: one until the next, as much until its answer and for a repeat, and the
// clock offset. More than the gap between samples that is bridged would be of no use.
double default_extrapolation_s(double rate_hz) {
  constexpr double kPolls = 4;
  const TelemetryLimits limits;
  return std::clamp(kPolls / rate_hz, limits.max_extrapolation_s, limits.max_gap_s);
}

RealtimeConfig read_realtime(YamlSection section, double rate_hz) {
  RealtimeConfig realtime;
  realtime.landmarks = section.choice("mode", {"OE", "PT"}, {}).value_or("OE") == "OE";
  realtime.priority =
      section.integer("priority", {0, 99, "SCHED_FIFO priority"}).value_or(realtime.priority);
  realtime.cpu = section.integer("cpu", {0, 1023, "processor number"}).value_or(realtime.cpu);
  realtime.lock_memory = section.truth("lock_memory").value_or(realtime.lock_memory);
  realtime.max_extrapolation_s = section.number("max_extrapolation_s", {0, 10, "s"})
                                     .value_or(default_extrapolation_s(rate_hz));
  section.finish();
  return realtime;
}

// "127.0.0.1:8080", "[::1]:8080", "name:8080"
void read_address(const YamlSection& section, const std::string& text, HttpServerOptions* options) {
  constexpr int kHighestPort = 65535;
  HttpServerOptions& http = *options;
  const std::size_t colon = text.rfind(':');
  const std::string port = colon == std::string::npos ? "" : text.substr(colon + 1);
  http.host = text.substr(0, colon);
  const bool bracketed =
      http.host.size() > 2 && http.host.front() == '[' && http.host.back() == ']';
  if (bracketed) http.host = http.host.substr(1, http.host.size() - 2);
  constexpr std::size_t kDigits = 5;
  if (http.host.empty() || (!bracketed && http.host.find(':') != std::string::npos) ||
      port.empty() || port.size() > kDigits ||
      port.find_first_not_of("0123456789") != std::string::npos || std::stoi(port) > kHighestPort) {
    section.fail("http", fmt::format("'{}' is not ADDRESS:PORT; expected for example "
                                     "127.0.0.1:8080, [::1]:8080, or 0.0.0.0:8080 for all networks",
                                     text));
  }
  http.port = std::stoi(port);
}

std::string token_of_environment(const YamlSection& section, const std::string& variable) {
  const char* value = std::getenv(variable.c_str());
  if (value != nullptr) return value;
  section.fail(
      "token_env",
      fmt::format("the environment has no variable '{}'; export it with the token", variable));
}

void read_tokens(YamlSection& section, const std::string& path, HttpServerOptions* http,
                 std::vector<std::string>* warnings) {
  const std::optional<std::string> variable = section.text("token_env");
  const std::optional<std::string> one = section.text("token_file");
  const std::optional<std::string> several = section.text("tokens_file");
  if (!variable && !one && !several) return;
  const char* key = variable ? "token_env" : one ? "token_file" : "tokens_file";
  if (!section.has("http")) section.fail(key, "is given without http; add http");
  if (variable && one) section.fail("token_file", "and token_env exclude each other; keep one");
  if (several && (variable || one))
    section.fail("tokens_file", fmt::format("and {} exclude each other; keep one", key));
  if (!variable) {
    http->token_file = path_relative_to(path, several ? *several : *one);
    http->token_file_holds_several = several.has_value();
    http->token_file_stamp = FileStamp(http->token_file);
    if (http->token_file_stamp.is_public())
      warnings->push_back(fmt::format("{}: other users of this machine can read {}; chmod o= it",
                                      section.where(key), http->token_file));
  }
  if (several) {
    std::string text;
    std::string error;
    if (!read_file(http->token_file, &text, &error))
      section.fail(key, error + "; put lines `view TOKEN` or `control TOKEN` there");
    if (!parse_tokens(text, &http->tokens, &error))
      section.fail(key, http->token_file + ": " + error);
    return;
  }
  http->token = variable ? token_of_environment(section, *variable)
                         : first_line_of(section, key, http->token_file, "token");
  if (!is_usable_token(http->token)) {
    section.fail(key, fmt::format("gives no token that can be used; expected at least {} letters, "
                                  "digits or signs without blanks",
                                  kShortestToken));
  }
}

std::optional<HttpTlsOptions> read_tls(YamlSection& section, const std::string& path) {
  YamlSection tls = section.section("tls");
  if (!section.has("tls")) return std::nullopt;
  if (!section.has("http")) section.fail("tls", "is given without http; add http");
  HttpTlsOptions options;
  options.certificate = path_relative_to(path, required_text(tls, "certificate", "server.pem"));
  options.key = path_relative_to(path, required_text(tls, "key", "server.key"));
  tls.finish();
  refuse_other_than_file(tls, "certificate", options.certificate);
  refuse_other_than_file(tls, "key", options.key);
  return options;
}

OutputConfig read_output(YamlSection section, const std::string& path,
                         std::vector<std::string>* warnings) {
  OutputConfig output;
  const std::optional<bool> json = section.truth("json");
  const bool csv = section.truth("csv").value_or(false);
  if (json.value_or(false) && csv)
    section.fail("csv", "json and csv cannot both go to stdout; keep one");
  if (csv) output.stdout_format = OutputFormat::kCsv;
  HttpServerOptions http;
  read_tokens(section, path, &http, warnings);
  http.tls = read_tls(section, path);
  if (const std::optional<std::string> address = section.text("http")) {
    read_address(section, *address, &http);
    output.http = http;
    if (http.token.empty() && http.tokens.empty() && !is_loopback(http.host)) {
      warnings->push_back(section.where("http") +
                          ": listens to other machines without a token: whoever reaches it may use "
                          "it; set token_env, token_file or tokens_file, or listen on 127.0.0.1");
    }
    if (json && !*json && !csv) output.stdout_format.reset();
  }
  if (const auto file = section.text("targets")) output.targets = path_relative_to(path, *file);
  if (const auto directory = section.text("recordings"))
    output.recordings = path_relative_to(path, *directory);
  section.finish();
  return output;
}

// While the head rests, the newest trusted angle is max_repeat_s old (core/realtime,
// TelemetryBuffer).
void check_ages(const Config& config, const YamlSection& pan_tilt, const YamlSection& realtime) {
  const double repeat_s = config.pan_tilt.max_repeat_s;
  const double extrapolation_s = config.realtime.max_extrapolation_s;
  if (repeat_s == 0 || repeat_s < extrapolation_s) return;
  const std::string why = "so a head at rest never has an angle that is new enough; expected ";
  const std::string right_repeat =
      extrapolation_s > 0 ? fmt::format("less than {}", extrapolation_s) : "0";
  if (pan_tilt.has("max_repeat_s")) {
    pan_tilt.fail("max_repeat_s",
                  fmt::format("is {} s, no less than realtime.max_extrapolation_s ({} s), {}{}, or "
                              "realtime.max_extrapolation_s more than {}",
                              repeat_s, extrapolation_s, why, right_repeat, repeat_s));
  }
  realtime.fail(
      "max_extrapolation_s",
      fmt::format("is {} s, no more than pan_tilt.max_repeat_s ({} s), {}more than {}, or "
                  "pan_tilt.max_repeat_s {}",
                  extrapolation_s, repeat_s, why, repeat_s, right_repeat));
}

// Without telemetry the scene map gives the orientation. For that it needs a calibrated lens.
void check_without_telemetry(const Config& config, const YamlSection& pan_tilt,
                             const YamlSection& calibration, const YamlSection& realtime) {
  if (config.scene_map.file.empty()) {
    pan_tilt.fail("type",
                  "none, but no scene map shows where the camera looks; set scene_map.file to a "
                  "map of alidade map build, or name the pan/tilt source");
  }
  if (config.calibration.file.empty()) {
    pan_tilt.fail("type",
                  "none, but nothing can be calibrated without telemetry; set calibration.file to "
                  "a calibration of this camera");
  }
  if (config.calibration.automatic && calibration.has("auto")) {
    calibration.fail(
        "auto", "is true, but pan_tilt.type none has nothing to calibrate with; set it to false");
  }
  if (!config.realtime.landmarks) {
    realtime.fail("mode", "is PT, which needs telemetry; with pan_tilt.type none set it to OE");
  }
  if (config.video.type == VideoConfig::Type::kRecording) {
    pan_tilt.fail("type",
                  "none is for live video only; a recording has telemetry: set it to recording");
  }
}

// Rules that span several sections.
void check_together(const Config& config, const YamlSection& calibration,
                    const YamlSection& scene_map, const std::string& path,
                    std::vector<std::string>* warnings) {
  if ((config.video.type == VideoConfig::Type::kRecording) !=
      (config.pan_tilt.type == PanTiltConfig::Type::kRecording)) {
    throw ConfigError(
        path +
        ": video and pan_tilt are a recording and a live stream, which have no common "
        "clock; set both types to recording, or neither");
  }
  const bool calibrates = config.calibration.automatic && config.realtime.landmarks &&
                          config.video.type != VideoConfig::Type::kRecording;
  if (!config.calibration.prior.empty() && !calibrates) {
    warnings->push_back(calibration.where("prior") +
                        ": is not used, as nothing is calibrated; calibrating needs live video, "
                        "realtime.mode OE and calibration.auto true");
  }
  if (!config.scene_map.file.empty() && !config.realtime.landmarks) {
    warnings->push_back(scene_map.where("file") +
                        ": is not used, as realtime.mode PT looks at no picture; set it to OE");
  }
  if (config.calibration.file.empty() && !config.camera.focal_length_px) {
    throw ConfigError(path +
                      ": neither a calibration nor a data sheet is given; set calibration.file or "
                      "camera.focal_length_px");
  }
}

// Detectors need `tracking`, as their boxes become targets. They look only at frames in OE mode.
void check_detectors(const Config& config, const YamlSection& detectors) {
  for (const DetectorKindRow& row : kDetectorKinds) {
    if (!config.detectors.has(row.kind)) continue;
    if (!config.tracking.targets)
      detectors.fail(row.name, "is given without section tracking; add tracking");
    if (!config.realtime.landmarks) {
      detectors.fail(row.name, "works in OE mode only, but realtime.mode is PT; set it to OE");
    }
    if (row.needs_ground && config.tracking.plane.empty()) {
      detectors.fail(row.name,
                     "needs the ground to know how large targets are in the picture; add "
                     "tracking.plane, a plane.yaml of alidade plane fit");
    }
  }
}

// Detections come over HTTP or from the built-in detectors.
void check_targets(const Config& config, const YamlSection& output) {
  if (!config.output.targets.empty() && !config.tracking.targets)
    output.fail("targets", "is given without section tracking; add tracking");
  if (!config.output.targets.empty() && !config.output.http && !config.detectors.any())
    output.fail("targets",
                "is given without http, over which detections come; add http, or detectors");
}

// Recordings are begun over HTTP.
void check_recordings(const Config& config, const YamlSection& output) {
  if (config.output.recordings.empty()) return;
  if (!config.output.http)
    output.fail("recordings", "is given without http, over which recordings are begun; add http");
  if (config.video.type == VideoConfig::Type::kRecording) {
    output.fail("recordings",
                "is given, but video.type is recording, which is stored already; leave "
                "it out, or name a live source");
  }
  if (config.pan_tilt.type == PanTiltConfig::Type::kNone) {
    output.fail("recordings",
                "is given, but a recording needs telemetry, and pan_tilt.type is none; "
                "leave it out, or name the pan/tilt source");
  }
}

void read_config(YamlSection& top, const std::string& path, ConfigScope scope, Config* config) {
  const YamlSection video = top.section("video");
  const YamlSection pan_tilt = top.section("pan_tilt");
  const YamlSection camera = top.section("camera");
  const YamlSection scene = top.section("scene");
  const YamlSection calibration = top.section("calibration");
  const YamlSection scene_map = top.section("scene_map");
  const YamlSection realtime = top.section("realtime");
  const YamlSection tracking = top.section("tracking");
  const YamlSection detectors = top.section("detectors");
  const YamlSection mqtt = top.section("mqtt");
  const YamlSection output = top.section("output");
  // Look for unknown sections first: one that seems missing may be there, mistyped.
  top.finish();
  for (const char* required : {"video", "pan_tilt"}) {
    const bool is_needed = scope == ConfigScope::kAll ||
                           (scope == ConfigScope::kVideo && required == std::string("video"));
    if (is_needed && !top.has(required))
      throw ConfigError(path + ": section '" + required + "' is missing; add it");
  }
  if (top.has("video")) config->video = read_video(video, path);
  if (top.has("pan_tilt")) config->pan_tilt = read_pan_tilt(pan_tilt, path);
  config->camera = read_camera(camera);
  config->scene = read_scene(scene);
  config->calibration = read_calibration(calibration, path);
  config->scene_map = read_scene_map(scene_map, path);
  config->realtime = read_realtime(realtime, config->pan_tilt.rate_hz);
  config->tracking = read_tracking(tracking, top.has("tracking"), path);
  config->detectors = read_detectors(detectors, path);
  if (scope == ConfigScope::kAll) check_ages(*config, pan_tilt, realtime);
  config->output = read_output(output, path, &config->warnings);
  if (top.has("mqtt")) config->mqtt = read_mqtt(mqtt, path, &config->warnings);
  if (scope != ConfigScope::kAll) return;
  if (config->pan_tilt.type == PanTiltConfig::Type::kNone) {
    check_without_telemetry(*config, pan_tilt, calibration, realtime);
    config->calibration.automatic = false;
  }
  check_together(*config, calibration, scene_map, path, &config->warnings);
  check_detectors(*config, detectors);
  check_targets(*config, output);
  check_recordings(*config, output);
}

}  // namespace

bool parse_config(const std::string& text, const std::string& path, Config* config,
                  std::string* error, ConfigScope scope) {
  *config = Config();
  return parse_yaml(
      text, path, [&](YamlSection& top) { read_config(top, path, scope, config); }, error);
}

bool load_config(const std::string& path, Config* config, std::string* error, ConfigScope scope) {
  *config = Config();
  return read_yaml_file(
      path, [&](YamlSection& top) { read_config(top, path, scope, config); }, error);
}

}  // namespace alidade
