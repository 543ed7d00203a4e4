// `alidade calibrate`: makes calibration, landmarks and a report from a recording's telemetry and
// tracks or video. A calibration that is not good enough is not written, so that it cannot replace
// a good one.

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <utility>
#include <vector>

#include "core/calibration/centre_frame.h"
#include "core/calibration/number_text.h"
#include "core/calibration/zoom_fit.h"
#include "edge_app/commands/calibrate.h"
#include "edge_app/commands/calibrate_zooms.h"
#include "edge_app/commands/calibration_input.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/lens_prior.h"
#include "edge_app/commands/output_directory.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/commands/visible_calibration.h"
#include "edge_app/output/calibration_report.h"
#include "edge_app/output/calibration_summary.h"
#include "edge_app/storage/calibration_file.h"
#include "edge_app/storage/map_file.h"
#include "platform/storage/recording.h"

namespace alidade {
namespace {

// Leaves *prior unchanged if `text` is empty.
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

void set_priors(const CalibrateOptions& options, int width, CalibrationOptions* calibration) {
  set_prior("--focal-length", options.focal_length, "px", &calibration->focal_length);
  set_prior("--aspect", options.aspect, "f_v / f_u", &calibration->aspect);
  static_assert(kDistortionCount == 1, "an option for each term");
  set_prior("--radial-distortion", options.radial_distortion, "1", &calibration->radial_distortion);
  set_prior("--line-delay", options.line_delay, "s/row", &calibration->line_delay);
  set_prior("--clock-offset", options.clock_offset, "s", &calibration->clock_offset);
  if (options.scale_sigma) {
    calibration->pan_scale.sigma = *options.scale_sigma;
    calibration->tilt_scale.sigma = *options.scale_sigma;
  }
  calibration->centre_sigma_px = options.centre_sigma_px.value_or(kUsualCentreShare * width);
  if (options.angle_accuracy_deg)
    calibration->angle_accuracy_rad = *options.angle_accuracy_deg * kPi / 180;
  if (options.pupil_m.size() == 3)
    calibration->pupil = {Vector3<double>(options.pupil_m.data()),
                          Vector3<double>::Constant(kStatedPupilSigma_m)};
  if (options.scene_distance_m.size() == 2)
    calibration->scene = SceneDistance{options.scene_distance_m[0], options.scene_distance_m[1]};
  std::string error;
  if (!calibration->validate(&error)) throw CommandError(kExitUsage, error);
}

// A value given as an option takes precedence over the file's.
void set_lens_prior(const CalibrateOptions& options, CalibrationJob* job) {
  if (options.prior.empty()) return;
  job->known = load_lens_prior(options.prior, job->input.width, job->input.height, &job->remarks);
  const auto give_way = [&](const char* option, const std::string& text, const char* what,
                            KnownValue* value) {
    if (text.empty()) return;
    value->wanted = false;
    job->remarks.push_back(fmt::format("{0}: its {3} is not used, as {1} {2} is given",
                                       options.prior, option, text, what));
  };
  give_way("--focal-length", options.focal_length, "focal length", &job->known.focal_length);
  give_way("--aspect", options.aspect, "aspect", &job->known.aspect);
  give_way("--radial-distortion", options.radial_distortion, "distortion",
           &job->known.radial_distortion);
  give_way("--line-delay", options.line_delay, "line delay", &job->known.line_delay);
}

std::vector<CalibrationJob> load_jobs(const CalibrateOptions& options) {
  std::vector<CalibrationJob> jobs;
  for (const std::string& recording : options.recordings) {
    for (CalibrationJob& job : load_calibration_jobs(recording, options.zoom_tolerance)) {
      set_priors(options, job.input.width, &job.options);
      set_lens_prior(options, &job);
      jobs.push_back(std::move(job));
    }
  }
  return jobs;
}

// Text of a tracks.csv, as recordings have it.
std::string tracks_text(const std::vector<CalibrationObservation>& observations) {
  std::string text = tracks_csv_columns() + "\n";
  for (const CalibrationObservation& seen : observations) {
    text += fmt::format("{},{},{:.4f},{:.4f},{:.4f}\n", seen.frame, seen.landmark, seen.u_px,
                        seen.v_px, seen.sigma_px);
  }
  return text;
}

// calibrate_job(), told in a camera frame with an exact optical centre (centre_frame.h).
CalibrationResult calibrate_in_one_frame(int passes, CalibrationJob* job, StopSignals* signals) {
  CalibrationResult free = calibrate_job(passes, job, signals);
  const Vector2<double>& prior = job->options.centre_offset_px;
  const double prior_sigma = job->options.centre_sigma_px;
  if (!(prior_sigma > 0) || !free.ok()) return free;
  const double sigma_u = parameter_sigma(free.calibration, Parameter::kCentreU);
  const double sigma_v = parameter_sigma(free.calibration, Parameter::kCentreV);
  const bool is_shown = centre_is_shown(free.calibration, prior, prior_sigma);
  spdlog::info("{}: optical centre right and down of the picture's middle: {}, {}{}",
               job->recording, estimate_text(free.calibration.camera.centre_u, sigma_u, "px"),
               estimate_text(free.calibration.camera.centre_v, sigma_v, "px"),
               is_shown ? "" : "; taken to be the middle");
  if (is_shown) {
    free.calibration = with_frame_through_centre(free.calibration);
    return free;
  }
  CalibrationOptions options = job->options;
  options.centre_sigma_px = 0;
  CalibrationResult exact = calibrate(job->input, options);
  if (!exact.ok()) return exact;
  exact.calibration = with_centre_error(exact.calibration, free.calibration);
  return exact;
}

int calibrate_one(const CalibrateOptions& options, CalibrationJob job, StopSignals* signals) {
  const std::string& recording = job.recording;
  const CalibrationResult result = calibrate_in_one_frame(options.passes, &job, signals);
  for (const std::string& remark : job.remarks) spdlog::warn("{}: {}", recording, remark);
  // Without a solution there is nothing to plot.
  if (result.frames.empty()) {
    for (const std::string& line : result.exclusions.describe()) {
      spdlog::warn("{}: left out: {}", recording, line);
    }
    throw CommandError(kExitFailed, fmt::format("{}: {}: {}", recording, to_string(result.status),
                                                result.message));
  }

  MapState map;
  if (job.tracks_from_video && result.ok()) map = map_visibly(recording, result, signals);

  OutputDirectory directory(options.directory, recording);
  directory.add(
      "report", "report.html",
      calibration_report({recording, job.input, job.options, result, job.remarks, ALIDADE_VERSION,
                          fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr))),
                          job.untracked}));
  if (job.tracks_from_video)
    directory.add("tracks", "tracks.csv", tracks_text(job.input.observations));
  if (result.ok()) {
    directory.add("landmarks", "map.bin", [&](const std::string& path, std::string* error) {
      return save_map(path, {result.landmarks, map}, result.calibration, error);
    });
    // Write this last: when it exists, all other files of the run do.
    directory.add("calibration", "calibration.yaml",
                  [&](const std::string& path, std::string* error) {
                    const CalibrationNotes notes{result.quality,
                                                 result.exclusions.describe(),
                                                 stated_priors(job.options),
                                                 "map.bin",
                                                 {},
                                                 result.telemetry_error,
                                                 job.options.pupil,
                                                 result.far_focal_length()};
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

int calibrate_recordings(const CalibrateOptions& options) {
  StopSignals signals;
  const OutputLock lock(output_path(options.directory, options.recordings.front()) +
                        "/calibration.yaml");
  std::vector<CalibrationJob> jobs = load_jobs(options);
  if (jobs.size() > 1) return calibrate_zooms(options, std::move(jobs), &signals);
  return calibrate_one(options, std::move(jobs.front()), &signals);
}

}  // namespace alidade
