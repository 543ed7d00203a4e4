// `alidade calibrate`: from the tracks or the video, and the telemetry, of a recording to its calibration,
// its landmarks and a report. A calibration that is not good enough is not written, so that it cannot replace one
// that is.

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <system_error>

#include "core/calibration/atomic_file.h"
#include "core/calibration/calibration_file.h"
#include "edge_app/commands/calibration_input.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/commands/video_tracks.h"
#include "edge_app/output/calibration_report.h"
#include "edge_app/output/calibration_summary.h"
#include "edge_app/pipeline/calibration_streams.h"
#include "edge_app/storage/map_file.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr double kShareOfLooking = 0.9;  // of the time that tracks and adjustment take

struct CalibrateOptions {
  std::string recording;  // its directory
  std::string directory;  // empty: <recording>/alidade
  bool json = false;
  int passes = 2;  // of finding tracks in the video
  // VALUE or VALUE,SIGMA; "free"; empty: as the estimator has it.
  std::string focal_length;
  std::string aspect;
  std::string radial_distortion;
  std::string line_delay;
  std::string clock_offset;
  std::optional<double> scale_sigma;
};

// Leaves *prior as it is if text is empty.
void set_prior(const char* option, const std::string& text, const char* unit,
               std::optional<CalibrationPrior>* prior) {
  if (text.empty()) return;
  if (text == "free") {
    prior->reset();
    return;
  }
  const char* at = text.c_str();
  char* end = nullptr;
  CalibrationPrior read;
  read.value = std::strtod(at, &end);
  bool good = end != at;
  if (good && *end == ',') {
    at = end + 1;
    read.sigma = std::strtod(at, &end);
    good = end != at;
  }
  if (!good || *end != '\0' || !std::isfinite(read.value) || !(read.sigma >= 0) ||
      !std::isfinite(read.sigma)) {
    throw CommandError(
        kExitUsage, fmt::format("{} {}: expected VALUE (exact), VALUE,SIGMA or free, in {}", option,
                                text, unit));
  }
  *prior = read;
}

void set_priors(const CalibrateOptions& options, CalibrationOptions* calibration) {
  set_prior("--focal-length", options.focal_length, "px", &calibration->focal_length);
  set_prior("--aspect", options.aspect, "f_v / f_u", &calibration->aspect);
  set_prior("--radial-distortion", options.radial_distortion, "1", &calibration->radial_distortion);
  set_prior("--line-delay", options.line_delay, "s/row", &calibration->line_delay);
  set_prior("--clock-offset", options.clock_offset, "s", &calibration->clock_offset);
  if (options.scale_sigma) {
    calibration->pan_scale.sigma = *options.scale_sigma;
    calibration->tilt_scale.sigma = *options.scale_sigma;
  }
  std::string error;
  if (!calibration->validate(&error)) throw CommandError(kExitUsage, error);
}

CalibrationJob load_job(const std::string& recording, const CalibrateOptions& options) {
  CalibrationJob job = load_calibration_job(recording);
  set_priors(options, &job.options);
  return job;
}

// What is done on a terminal; the first SIGINT or SIGTERM cancels at the next step, the second ends the process
// as usual.
class VisibleProgress {
 public:
  VisibleProgress(const std::string& name, StopSignals* signals) : name_(name), signals_(signals) {}
  VisibleProgress(const VisibleProgress&) = delete;
  VisibleProgress& operator=(const VisibleProgress&) = delete;
  ~VisibleProgress() {
    if (show_) fmt::print(stderr, "\r\033[K");
  }

  // What show() is told from now on is the part of the whole from `begin` to `end`.
  void set_part(double begin, double end) {
    begin_ = begin;
    end_ = end;
  }
  // False: cancelled.
  bool show(double done, const char* what) {
    const double percent = 100 * (begin_ + done * (end_ - begin_));
    if (show_) fmt::print(stderr, "\r\033[K{}: {:3.0f} % {}", name_, percent, what);
    return signals_->wait(-1, 0) != StopSignals::Event::kSignal;
  }
  [[nodiscard]] CommandError cancelled() const {
    return {kExitFailed, name_ + ": calibration interrupted; nothing stored"};
  }

 private:
  const std::string& name_;
  StopSignals* signals_;
  bool show_ = is_terminal(STDERR_FILENO);
  double begin_ = 0;
  double end_ = 1;
};

// `begin` of the part is done already.
CalibrationResult calibrate_visibly(CalibrationJob* job, double begin, VisibleProgress* progress) {
  job->options.progress = [begin, progress](double done, const char* what) {
    return progress->show(begin + (1 - begin) * done, what);
  };
  CalibrationResult result = calibrate(job->input, job->options);
  if (result.status == CalibrationStatus::kCancelled) throw progress->cancelled();
  return result;
}

// Finds tracks, without or with a first estimate, and calibrates with them.
CalibrationResult calibrate_video(const std::string& recording, const CalibrationResult* estimate,
                                  CalibrationJob* job, std::vector<std::string>* remarks,
                                  VisibleProgress* progress) {
  const VideoProgress look = [progress, estimate](double done) {
    const char* what = estimate == nullptr ? "following points in the video"
                                           : "following points again, with the estimated camera";
    // Looking at the video takes nearly all of the time.
    if (!progress->show(kShareOfLooking * done, what)) throw progress->cancelled();
  };
  VideoTracks tracks = estimate == nullptr ? track_video(recording, job->input, look)
                                           : track_video(recording, job->input, *estimate, look);
  *remarks = std::move(tracks.remarks);
  job->input.observations = choose_tracks(tracks.observations);
  return calibrate_visibly(job, kShareOfLooking, progress);
}

CalibrationResult calibrate_job(const std::string& recording, int passes, CalibrationJob* job,
                                StopSignals* signals) {
  VisibleProgress progress(recording, signals);
  if (!job->tracks_from_video) return calibrate_visibly(job, 0, &progress);
  std::vector<std::string> remarks;
  progress.set_part(0, passes > 1 ? 0.5 : 1);
  CalibrationResult first = calibrate_video(recording, nullptr, job, &remarks, &progress);
  if (job->input.observations.empty()) {
    throw CommandError(
        kExitFailed,
        fmt::format(
            "{}: no point of the video could be followed through {} frames; film a far scene "
            "with texture, lit and in focus, that stays in view for that long",
            recording, kMinSightings));
  }
  const bool usable = first.ok() || first.status == CalibrationStatus::kWeak;
  if (passes > 1 && usable) {
    const std::vector<CalibrationObservation> first_tracks = job->input.observations;
    progress.set_part(0.5, 1);
    CalibrationResult second = calibrate_video(recording, &first, job, &remarks, &progress);
    if (second.ok() || !first.ok()) {
      first = std::move(second);
    } else {
      job->input.observations = first_tracks;
      remarks.push_back(fmt::format(
          "the second look at the video led to no calibration ({}: {}); this is the first one's",
          to_string(second.status), second.message));
    }
  }
  job->remarks.insert(job->remarks.end(), remarks.begin(), remarks.end());
  return first;
}

MapState map_visibly(const std::string& recording, const CalibrationResult& result,
                     StopSignals* signals) {
  VisibleProgress progress(recording, signals);
  return map_video(recording, result, [&progress](double done) {
    if (!progress.show(done, "looking at some pictures for the map")) throw progress.cancelled();
  });
}

// The format of a recording's tracks.csv.
std::string tracks_text(const std::vector<CalibrationObservation>& observations) {
  std::string text = "frame,landmark,u_px,v_px,sigma_px\n";
  for (const CalibrationObservation& seen : observations) {
    text += fmt::format("{},{},{:.4f},{:.4f},{:.4f}\n", seen.frame, seen.landmark, seen.u_px,
                        seen.v_px, seen.sigma_px);
  }
  return text;
}

class OutputDirectory {
 public:
  OutputDirectory(const std::string& given, const std::string& recording)
      : path_(given.empty() ? fs::path(recording) / "alidade" : fs::path(given)) {
    std::error_code error;
    fs::create_directories(path_, error);
    if (error) {
      throw CommandError(kExitFailed, path_.string() + ": cannot be made: " + error.message() +
                                          "; give a directory that can be written with -o");
    }
  }

  // write(path, &error) -> bool. Remembers the file under `kind`.
  template <class Write>
  void add(const char* kind, const char* name, Write write) {
    const std::string path = (path_ / name).string();
    std::string error;
    if (!write(path, &error)) {
      throw CommandError(kExitFailed, error + "; give a directory with room with -o");
    }
    files_.emplace_back(kind, path);
  }
  [[nodiscard]] const std::vector<std::pair<std::string, std::string>>& files() const {
    return files_;
  }

 private:
  fs::path path_;
  std::vector<std::pair<std::string, std::string>> files_;
};

int calibrate_recording(const CalibrateOptions& options) {
  const std::string& recording = options.recording;
  StopSignals signals;
  CalibrationJob job = load_job(recording, options);
  const CalibrationResult result = calibrate_job(recording, options.passes, &job, &signals);
  for (const std::string& remark : job.remarks) spdlog::warn("{}: {}", recording, remark);
  // Without a solution there is nothing to draw.
  if (result.frames.empty()) {
    for (const std::string& line : result.exclusions.describe()) {
      spdlog::warn("{}: left out: {}", recording, line);
    }
    throw CommandError(kExitFailed, fmt::format("{}: {}: {}", recording, to_string(result.status),
                                                result.message));
  }

  MapState map;
  if (job.tracks_from_video && result.ok()) map = map_visibly(recording, result, &signals);

  OutputDirectory directory(options.directory, recording);
  directory.add("report", "report.html", [&](const std::string& path, std::string* error) {
    return write_file_atomically(
        path, calibration_report({recording, job.input, job.options, result, job.remarks}), error);
  });
  if (job.tracks_from_video) {
    directory.add("tracks", "tracks.csv", [&](const std::string& path, std::string* error) {
      return write_file_atomically(path, tracks_text(job.input.observations), error);
    });
  }
  if (result.ok()) {
    directory.add("landmarks", "map.bin", [&](const std::string& path, std::string* error) {
      return save_map(path, {result.landmarks, map}, result.calibration, error);
    });
    // Last: when it stands, all of its run does.
    directory.add("calibration", "calibration.yaml",
                  [&](const std::string& path, std::string* error) {
                    const CalibrationNotes notes{result.quality, result.exclusions.describe(),
                                                 stated_priors(job.options), "map.bin"};
                    return save_calibration(path, result.calibration, notes, error);
                  });
  }
  std::fputs(options.json ? summary_json(result, job.options, directory.files()).c_str()
                          : summary_text(result, job.options).c_str(),
             stdout);
  if (std::fflush(stdout) != 0) throw CommandError(kExitFailed, "stdout: cannot be written");
  for (const auto& [kind, path] : directory.files()) spdlog::info("{}: {}", kind, path);
  if (!result.ok()) {
    throw CommandError(kExitFailed, fmt::format("{}: {}: {}", recording, to_string(result.status),
                                                result.message));
  }
  return kExitOk;
}

}  // namespace

void register_calibrate(CLI::App& app, int* exit_code) {
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

}  // namespace alidade
