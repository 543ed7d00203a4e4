// `alidade run`: live orientation of each frame. The threads are the Pipeline's; this one waits for
// a signal, the end of the time asked for, or the end of the pipeline.

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <limits>

#include "edge_app/commands/command.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/output/record_writer.h"
#include "edge_app/pipeline/pipeline.h"

namespace alidade {
namespace {

struct RunOptions {
  std::string config;
  double duration_s = std::numeric_limits<double>::infinity();
  bool json = false;
  bool csv = false;
};

std::string describe(const RealtimeOptions& options) {
  return fmt::format(
      "{}, {}, memory {}",
      options.priority > 0 ? fmt::format("SCHED_FIFO {}", options.priority) : "normal scheduling",
      options.cpu >= 0 ? fmt::format("processor {}", options.cpu) : "any processor",
      options.lock_memory ? "locked" : "not locked");
}

std::string describe(const PipelineSummary& summary, bool latency_measured) {
  const std::string latency = latency_measured ? fmt::format("latency p50 {:.3f} ms, p99 {:.3f} ms",
                                                             1e3 * summary.latency.quantile(0.5),
                                                             1e3 * summary.latency.quantile(0.99))
                                               : "latency not measured on a recording";
  return fmt::format(
      "{} frames; {} records: PT {}, none {}; {}; dropped by full queues: {} frames, {} telemetry "
      "samples, {} records",
      summary.frames, summary.records, summary.with_orientation,
      summary.records - summary.with_orientation, latency, summary.drops.frames,
      summary.drops.telemetry, summary.drops.records);
}

int run(const RunOptions& options) {
  const Config config = require_config(options.config);
  const NamedCalibration calibration = choose_calibration(config);
  spdlog::info("calibration: {}", calibration.name);

  PipelineOptions pipeline_options;
  pipeline_options.step = step_options(config, calibration);
  pipeline_options.realtime = {config.realtime.priority, config.realtime.cpu,
                               config.realtime.lock_memory};
  pipeline_options.width = calibration.calibration.camera.width;
  pipeline_options.height = calibration.calibration.camera.height;
  pipeline_options.calibration_name = calibration.name;
  pipeline_options.measure_latency = !is_recording(config);

  OutputFormat format = config.output;
  if (options.json) format = OutputFormat::kJson;
  if (options.csv) format = OutputFormat::kCsv;

  StopSignals signals;
  const auto video = make_frame_source(config.video);
  const auto pan_tilt = make_pan_tilt_source(config.pan_tilt);
  spdlog::info("video: {}; pan/tilt: {}", video->name(), pan_tilt->name());
  spdlog::info("real-time thread: {}", describe(pipeline_options.realtime));
  RecordWriter writer(STDOUT_FILENO, format, "stdout");
  Pipeline pipeline(*video, *pan_tilt, writer, pipeline_options);
  pipeline.start();
  static_cast<void>(signals.wait(pipeline.finished_fd(), options.duration_s));
  pipeline.stop();

  spdlog::info("{}", describe(pipeline.summary(), pipeline_options.measure_latency));
  log_source_losses(*video);
  if (writer.dropped() > 0)
    spdlog::warn("{} records not taken by a stalled reader at the end", writer.dropped());
  if (!pipeline.error().empty()) throw CommandError(kExitFailed, pipeline.error());
  return kExitOk;
}

}  // namespace

void register_run(CLI::App& app, int* exit_code) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* command =
      app.add_subcommand("run", "Live: an orientation for each video frame, on stdout");
  command->add_option("-c,--config", options->config, "Configuration (YAML)")->required();
  command->add_option("--duration", options->duration_s, "End after so many seconds")
      ->check(CLI::PositiveNumber);
  CLI::Option* json =
      command->add_flag("--json", options->json, "JSON Lines, whatever the configuration says");
  command->add_flag("--csv", options->csv, "CSV, whatever the configuration says")->excludes(json);
  command->callback([options, exit_code] { *exit_code = run(*options); });
}

}  // namespace alidade
