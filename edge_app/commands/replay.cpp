// `alidade replay`: runs the real-time step over a recording, on one thread. A frame is answered
// with the telemetry received up to its receive time, as in a live run. So each replay gives the
// same records as the live step would have. One exception: a live run must wait to learn whether
// the first frames were delayed; a replay sees it in the later frames. OE mode also decodes images.
// A frame whose image cannot be decoded is answered from telemetry. No configuration is read:
// TelemetryLimits has its defaults.

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "edge_app/clocks/fresh_beginning.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/partial_file.h"
#include "edge_app/commands/replay.h"
#include "edge_app/commands/replay_input.h"
#include "edge_app/commands/replay_targets.h"
#include "edge_app/commands/run_report.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/config/noise_file.h"
#include "edge_app/output/record_writer.h"
#include "edge_app/pipeline/latency_histogram.h"
#include "platform/pan_tilt/recording_pan_tilt_source.h"
#include "platform/storage/recording.h"
#include "platform/system/clock.h"
#include "platform/system/text.h"
#include "platform/video/recording_frame_source.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

// The file of the records. It gets its name only when it is complete.
class OrientationFile {
 public:
  explicit OrientationFile(const std::string& directory)
      : file_((fs::path(directory) / "orientation.csv").string()),
        writer_(file_.descriptor(), OutputFormat::kCsv, file_.path(),
                RecordWriter::Stalled::kWait) {}

  void write(const OrientationRecord& record) {
    if (!writer_.write(record)) throw CommandError(kExitFailed, writer_.error());
  }
  void complete() { file_.complete(); }
  [[nodiscard]] const std::string& path() const { return file_.path(); }

 private:
  PartialFile file_;
  RecordWriter writer_;
};

// The images for OE mode; null: PT mode.
std::unique_ptr<RecordedImages> open_images(const ReplayOptions& options) {
  const std::string& recording = options.recording;
  const bool demanded = options.mode == "OE";
  if (options.mode == "PT") return nullptr;
  if (!has_images(recording)) {
    if (!demanded) {
      spdlog::info("{}: has no pictures (video.mkv or frames/); replayed in PT mode", recording);
      return nullptr;
    }
    throw CommandError(kExitUsage, recording +
                                       ": has no pictures (video.mkv or frames/), which OE mode "
                                       "needs; use --mode PT");
  }
  try {
    return std::make_unique<RecordedImages>(recording);
  } catch (const CommandError& error) {
    if (demanded) throw;
    spdlog::warn("{}; replayed in PT mode", error.what());
    return nullptr;
  }
}

// Counts for the last two lines of the log.
class Summary {
 public:
  explicit Summary(bool wants_landmarks) : reasons_(wants_landmarks) {}

  void add(const OrientationRecord& record, double step_s) {
    ++frames_;
    if (record.mode == RecordMode::kOe) landmarks_.push_back(record.landmarks);
    if (record.mode == RecordMode::kPt) ++pt_;
    reasons_.add(record);
    step_s_.add(step_s);
  }
  [[nodiscard]] std::int64_t frames() const { return frames_; }
  [[nodiscard]] const ReasonCounts& reasons() const { return reasons_; }
  std::string line() {
    const auto oe = static_cast<std::int64_t>(landmarks_.size());
    std::string line = fmt::format("{}: OE {}, PT {}, none {}", counted(frames_, "frame"), oe, pt_,
                                   frames_ - oe - pt_);
    if (!landmarks_.empty()) {
      const auto middle = landmarks_.begin() + static_cast<std::ptrdiff_t>(oe / 2);
      std::nth_element(landmarks_.begin(), middle, landmarks_.end());
      line += fmt::format("; {} landmarks (median)", *middle);
    }
    return line + fmt::format("; step {:.3f} / {:.3f} ms (p50 / p99)", 1e3 * step_s_.quantile(0.5),
                              1e3 * step_s_.quantile(0.99));
  }

 private:
  std::int64_t frames_ = 0;
  std::int64_t pt_ = 0;
  std::vector<int> landmarks_;  // of each frame in OE mode
  ReasonCounts reasons_;
  LatencyHistogram step_s_;
};

}  // namespace

int replay_recording(const ReplayOptions& options) {
  std::string error;
  RecordingInfo info;
  if (!read_recording_info(options.recording, &info, &error))
    throw CommandError(kExitFailed, error);
  const PublishedCalibration calibration = find_calibration(options.recording, options.calibration);
  error = size_error(info, calibration, options.recording);
  if (!error.empty()) throw CommandError(kExitFailed, error);
  RecordingNoise noise;
  if (!load_noise(options.recording, &noise, &error)) throw CommandError(kExitFailed, error);
  const std::unique_ptr<RecordedImages> images = open_images(options);
  OrientationStepOptions of_step = step_options(noise, calibration);
  of_step.zoom_tolerance = options.zoom_tolerance;
  if (images) of_step.oe = oe_options(calibration.calibration.camera);
  // Time stamps that scatter to both sides are not arrival times, so they show no delay.
  of_step.wait_for_pace = !noise.image_stamp_sigma_s;
  OrientationStep step(of_step);
  std::vector<FrameStamp> stamps;
  if (!read_frames_csv(options.recording, &stamps, &error)) throw CommandError(kExitFailed, error);
  if (begins_fresh(stamps)) step.expect_fresh_frames();

  StopSignals signals;
  const auto video = open_recorded_frames({options.recording, false, false});
  const auto pan_tilt = open_recorded_pan_tilt({options.recording, false});
  const std::string directory = options.directory.empty()
                                    ? (fs::path(options.recording) / "alidade").string()
                                    : options.directory;
  std::error_code not_made;
  fs::create_directories(directory, not_made);  // on failure OrientationFile reports the error
  OrientationFile file(directory);
  std::optional<ReplayTargets> targets;
  if (!options.detections.empty()) {
    targets.emplace(options.detections, options.tracking,
                    (fs::path(directory) / "targets.jsonl").string(), &signals);
  }
  std::optional<RecordWriter> out;
  if (options.json || options.csv) {
    out.emplace(STDOUT_FILENO, options.json ? OutputFormat::kJson : OutputFormat::kCsv, "stdout",
                RecordWriter::Stalled::kWait);
  }

  const bool progress = is_terminal(STDERR_FILENO);
  const double start_s = monotonic_now_s();
  std::optional<double> first_s;
  Summary summary(images != nullptr);
  std::optional<PanTiltSample> sample = next_of<PanTiltSample>(*pan_tilt);
  while (const std::optional<Frame> frame = next_of<Frame>(*video)) {
    const FrameStamp& stamp = frame->stamp;
    if (!first_s) first_s = stamp.receive_time_s;
    // A frame is due when it was received. If time stamps jump back, it is due at once.
    const double wait_s =
        options.realtime ? start_s + (stamp.receive_time_s - *first_s) - monotonic_now_s() : 0;
    if (signals.wait(-1, wait_s) == StopSignals::Event::kSignal) {
      throw CommandError(kExitFailed, options.recording + ": replay interrupted; nothing stored");
    }
    for (; sample && sample->latest_time_s <= stamp.receive_time_s;
         sample = next_of<PanTiltSample>(*pan_tilt)) {
      step.add_telemetry(*sample);
    }
    const std::optional<Frame> image = images ? images->of(stamp) : std::nullopt;
    StepEvents events;
    const double before_s = monotonic_now_s();
    const OrientationRecord record = step.add_frame(stamp, view_of(image), &events);
    summary.add(record, monotonic_now_s() - before_s);
    file.write(record);
    if (out && !out->write(record)) {
      if (!out->error().empty()) throw CommandError(kExitFailed, out->error());
      out.reset();
    }
    if (targets) targets->add(record);
    step.maintain();
    if (progress && summary.frames() % 1000 == 0)
      fmt::print(stderr, "\r{} frames ", summary.frames());
  }
  if (progress) fmt::print(stderr, "\r");
  if (images) {
    for (const std::string& remark : images->remarks()) spdlog::warn("{}", remark);
  }
  if (targets) spdlog::info("{}", targets->complete());
  file.complete();
  const std::string reasons =
      describe(summary.reasons(), calibration.calibration, calibration.zoom_curve);
  if (!reasons.empty()) spdlog::info("{}", reasons);
  spdlog::info("{}: {}", file.path(), summary.line());
  return kExitOk;
}

}  // namespace alidade
