// `alidade run`: live orientation of each frame; the camera calibrates itself. The Pipeline has the
// threads. This one waits for a signal, the end of the duration or the end of the pipeline, and
// meanwhile tells systemd that the threads are alive.

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <system_error>

#include "edge_app/commands/command.h"
#include "edge_app/commands/live_calibration.h"
#include "edge_app/commands/live_targets.h"
#include "edge_app/commands/plane.h"
#include "edge_app/commands/recording_verifier.h"
#include "edge_app/commands/run.h"
#include "edge_app/commands/run_report.h"
#include "edge_app/commands/scene_loading.h"
#include "edge_app/commands/side_files.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/output/http/http_server.h"
#include "edge_app/output/http_api.h"
#include "edge_app/output/live_state.h"
#include "edge_app/output/manual_pages.h"
#include "edge_app/output/mqtt_publisher.h"
#include "edge_app/output/record_sinks.h"
#include "edge_app/output/record_writer.h"
#include "edge_app/output/status_page.h"
#include "edge_app/pipeline/pipeline.h"
#include "edge_app/record/frame_geometry.h"
#include "edge_app/storage/calibration_file.h"
#include "edge_app/storage/calibration_store.h"
#include "platform/storage/recording.h"
#include "platform/system/clock.h"
#include "platform/system/realtime.h"
#include "platform/system/service_manager.h"

namespace alidade {
namespace {

std::string describe(const RealtimeOptions& options) {
  return fmt::format(
      "{}, {}, memory {}",
      options.priority > 0 ? fmt::format("SCHED_FIFO {}", options.priority) : "normal scheduling",
      options.cpu >= 0 ? fmt::format("processor {}", options.cpu) : "any processor",
      options.lock_memory ? "locked" : "not locked");
}

PipelineOptions pipeline_options(const Config& config, const PublishedCalibration& calibration) {
  PipelineOptions options;
  options.step = step_options(config, calibration);
  options.step.has_telemetry = has_telemetry(config);
  options.step.zoom_tolerance = config.calibration.zoom_tolerance;
  if (config.realtime.landmarks) {
    options.step.oe = oe_options(calibration.calibration.camera);
  } else {
    options.step.follow_turns = options.step.other_connection && calibration.calibrated &&
                                !config.calibration.clock_offset_sigma_s;
  }
  options.realtime = {config.realtime.priority, config.realtime.cpu, config.realtime.lock_memory};
  options.width = calibration.calibration.camera.width;
  options.height = calibration.calibration.camera.height;
  options.calibration_name = calibration.name;
  options.measure_latency = !is_recording(config);
  return options;
}

SceneTapOptions scene_tap_options(const SceneMapConfig& config) {
  SceneTapOptions options;  // least_pause_s has no key
  options.interval_s = config.interval_s;
  return options;
}

// Null if no server is configured.
std::unique_ptr<HttpServer> make_http(const Config& config, const HttpApiSources& sources,
                                      ImageTap* tap) {
  if (!config.output.http) return nullptr;
  auto server = std::make_unique<HttpServer>(*config.output.http);
  add_api_routes(server.get(), sources);
  add_status_page(server.get(), tap);
  add_manual_pages(server.get(), installed_manual());
  return server;
}

// False: a signal came first.
bool start_http(HttpServer* server, const HttpServerOptions& options, StopSignals* signals) {
  std::string error;
  if (!server->check_tls(&error)) throw CommandError(kExitUsage, error);
  const auto wait = [signals](int descriptor, double timeout_s) {
    return signals->wait(descriptor, timeout_s) != StopSignals::Event::kSignal;
  };
  if (!server->start(wait, &error)) {
    if (error.empty()) return false;
    throw CommandError(kExitFailed, error);
  }
  spdlog::info("HTTP: listening on {}://{}/{}", options.tls ? "https" : "http", server->address(),
               !options.tokens.empty() ? fmt::format(", with {} tokens", options.tokens.size())
               : options.token.empty() ? ""
                                       : ", with a token");
  return true;
}

// Null if no broker is configured.
std::unique_ptr<MqttPublisher> make_mqtt(const Config& config, LiveTargets* targets) {
  if (!config.mqtt) return nullptr;
  const std::string error = MqttConnection::files_error(*config.mqtt);
  if (!error.empty()) throw CommandError(kExitUsage, error);
  auto mqtt = std::make_unique<MqttPublisher>(*config.mqtt);
  if (targets != nullptr) {
    targets->feed().add_on_news([mqtt = mqtt.get(), lines = &targets->lines()](const auto&) {
      mqtt->take_targets(lines->newest().json);
    });
  }
  return mqtt;
}

// Puts the calibration in use where `verify` and `replay` look for that of a recording. Does
// nothing while there is none. pipeline: null before it runs.
bool store_calibration_in_use(const Config& config, const LiveState& live, const Pipeline* pipeline,
                              const std::string& recording, std::string* error) {
  const auto newest = live.newest();
  if (!newest || !newest->calibrated || pipeline == nullptr) return true;
  CalibrationNotes notes;
  const auto curve = pipeline->zoom_curve();
  if (curve && newest->camera.zoom) notes.zoom_curve = *curve;
  if (const auto telemetry = pipeline->telemetry_error()) notes.telemetry_error = *telemetry;
  notes.pupil = config.camera.pupil;
  const std::filesystem::path folder = std::filesystem::path(recording) / "alidade";
  std::error_code code;
  std::filesystem::create_directory(folder, code);
  return save_calibration((folder / "calibration.yaml").string(), unpack(newest->camera), notes,
                          error);
}

// Null if no directory for recordings is configured. pipeline: borrowed; where it will be.
std::unique_ptr<LiveRecorder> make_recorder(const Config& config, const LiveState* live,
                                            const Pipeline* const* pipeline) {
  if (config.output.recordings.empty()) return nullptr;
  LiveRecorderOptions options;
  options.parent = config.output.recordings;
  options.write_side_files = [=](const std::string& directory, std::string* error) {
    return write_side_files(config, directory, error) &&
           store_calibration_in_use(config, *live, *pipeline, directory, error);
  };
  return std::make_unique<LiveRecorder>(std::move(options));
}

// Waits for a signal, the end of the pipeline or the end of the duration. Gives back which it was,
// for people.
std::string wait_for_the_end(StopSignals* signals, const Pipeline& pipeline, LifeReport* report,
                             double duration_s) {
  const double end_s = monotonic_now_s() + duration_s;
  double left_s = duration_s;
  while (left_s > 0) {
    const double wait_s = std::min(left_s, report->period_s());
    switch (signals->wait(pipeline.finished_fd(), wait_s)) {
      case StopSignals::Event::kSignal:
        return signals->seen();
      case StopSignals::Event::kDescriptor:
        return "the sources have ended";
      case StopSignals::Event::kTimeout:
        break;
    }
    report->tell();
    left_s = end_s - monotonic_now_s();
  }
  return "the duration is over";
}

}  // namespace

int run_live(const RunOptions& options) {
  const Config config = require_config(options.config);
  if (is_recording(config)) {
    RecordingInfo info;
    std::string error;
    if (!read_recording_info(config.video.directory, &info, &error))
      throw CommandError(kExitFailed, error);
  }
  const std::shared_ptr<const PlaneEstimate> plane = require_plane(config);
  auto [calibrating, calibration] =
      load_starting_calibration(config, options.config, CalibrationStore::Use::kKeep);
  spdlog::info("calibration: {}", calibration.name);
  PipelineOptions of_pipeline = pipeline_options(config, calibration);
  of_pipeline.step.map = std::move(calibration.map);
  of_pipeline.step.follow_points = calibrating.calibration && config.calibration.automatic;

  std::optional<OutputFormat> format = config.output.stdout_format;
  if (options.json) format = OutputFormat::kJson;
  if (options.csv) format = OutputFormat::kCsv;

  StopSignals signals;
  VideoConfig of_video = config.video;
  if (of_video.width == 0 && of_video.type != VideoConfig::Type::kV4l2) {
    of_video.width = of_pipeline.width;
    of_video.height = of_pipeline.height;
  }
  const auto video =
      make_frame_source(of_video, config.realtime.landmarks || of_pipeline.step.follow_turns);
  const auto pan_tilt = make_pan_tilt_source(config.pan_tilt);
  spdlog::info("video: {}; pan/tilt: {}", video->name(), pan_tilt->name());
  spdlog::info("real-time thread: {}", describe(of_pipeline.realtime));
  // With a recording, records may wait for the reader, as none must be missing.
  const auto stalled =
      is_recording(config) ? RecordWriter::Stalled::kWait : RecordWriter::Stalled::kDrop;
  RecordWriter writer(STDOUT_FILENO, format.value_or(OutputFormat::kJson), "stdout", stalled);
  LiveState live;
  RecordSinks sinks;
  // First, as this sink never waits.
  if (config.output.http) sinks.add(&live);
  const std::unique_ptr<LiveTargets> targets = make_live_targets(config, plane);
  const std::unique_ptr<MqttPublisher> mqtt = make_mqtt(config, targets.get());
  if (mqtt) sinks.add(mqtt.get());
  if (format) sinks.add(&writer);
  ImageTap tap;
  if (config.output.http) of_pipeline.tap = &tap;
  if (targets) of_pipeline.detectors = targets->detector_tap();
  const auto scene = load_scene(config, calibration);
  std::optional<SceneTap> scene_tap;
  if (scene) of_pipeline.scene = &scene_tap.emplace(*scene, scene_tap_options(config.scene_map));
  const Pipeline* running = nullptr;
  const std::unique_ptr<LiveRecorder> recorder = make_recorder(config, &live, &running);
  of_pipeline.recorder = recorder.get();
  Pipeline pipeline(*video, *pan_tilt, sinks, calibrating.calibration.get(), of_pipeline);
  running = &pipeline;
  HttpApiSources sources;
  sources.live = &live;
  sources.summary = [&pipeline] { return pipeline.summary(); };
  sources.zoom_curve = [&pipeline] { return pipeline.zoom_curve(); };
  sources.telemetry_error = [&pipeline] { return pipeline.telemetry_error(); };
  sources.calibration_progress = [&pipeline] { return pipeline.calibration_progress(); };
  sources.video_losses = [&video] { return video->counters(); };
  sources.ask_for_calibration = [self = calibrating.calibration.get()] {
    return self != nullptr && self->ask_for_fresh();
  };
  sources.plane = plane;
  sources.pupil = config.camera.pupil;
  if (config.scene)
    sources.scene_nearness = scene_nearness(config.camera.pupil, *config.scene).value;
  sources.fit_plane = answer_plane_fit;
  if (targets) {
    sources.targets = &targets->feed();
    sources.target_lines = &targets->lines();
    if (targets->detector_tap() != nullptr)
      sources.detectors = [&targets] { return targets->detectors(); };
  }
  sources.mqtt = mqtt.get();
  sources.recorder = recorder.get();
  std::optional<RecordingVerifier> verifier;
  if (recorder) {
    verifier.emplace();
    sources.verify_recording = [&verifier](const auto& directory) {
      return verifier->begin(directory);
    };
    sources.verification = [&verifier] { return verifier->state(); };
  }
  if (scene) {
    sources.scene = [&scene] { return scene->report(); };
    sources.scene_outlines = &scene->outlines();
  }
  sources.version = ALIDADE_VERSION;
  sources.camera = video->name();
  sources.latency_measured = of_pipeline.measure_latency;
  const auto http = make_http(config, sources, &tap);
  if (http && !start_http(http.get(), *config.output.http, &signals)) return kExitOk;
  if (mqtt && !mqtt->start())
    throw CommandError(kExitFailed, "the thread for MQTT cannot be started");
  if (targets) targets->start();
  if (calibrating.calibration && config.calibration.automatic && config.calibration.file.empty()) {
    spdlog::warn(
        "calibration: calibration.file is not set: what this camera is calibrated to is lost when "
        "the program ends, and each start begins with the data sheet; name a file to keep it");
  }
  pipeline.start();
  const ServiceManager manager;
  manager.ready();
  LifeReport report(manager, &pipeline);
  const std::string end = wait_for_the_end(&signals, pipeline, &report, options.duration_s);
  spdlog::info("run ends: {}", end);
  manager.stopping();
  if (http) http->stop();
  if (targets) targets->stop();
  if (recorder) static_cast<void>(recorder->end());
  pipeline.stop();
  if (mqtt) mqtt->stop();

  const PipelineSummary summary = pipeline.summary();
  const std::string reasons =
      describe(summary.reasons, calibration.calibration, *pipeline.zoom_curve());
  if (!reasons.empty()) spdlog::info("{}", reasons);
  spdlog::info("{}", describe(summary, of_pipeline.measure_latency));
  log_source_losses(*video);
  if (writer.dropped() > 0)
    spdlog::warn("{} records were not written, as the reader of stdout was too slow",
                 writer.dropped());
  if (!pipeline.error().empty()) throw CommandError(kExitFailed, pipeline.error());
  return kExitOk;
}

}  // namespace alidade
