#include "edge_app/commands/calibration_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <unordered_set>
#include <utility>

#include "core/calibration/zoom_stretches.h"
#include "core/model/median.h"
#include "core/model/recording_needs.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/video_tracks.h"
#include "edge_app/config/noise_file.h"
#include "edge_app/self_calibration/calibration_streams.h"
#include "edge_app/self_calibration/steady_samples.h"
#include "platform/storage/recording.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

// A few points outside the image are left to the calibration. Many mean an image of another size.
void check_size(const std::string& directory, const RecordingInfo& info,
                const std::vector<TrackPoint>& tracks) {
  constexpr double kMaxShare = 0.1;
  const auto outside = std::count_if(tracks.begin(), tracks.end(), [&](const TrackPoint& point) {
    return point.u_px < 0 || point.u_px > info.width || point.v_px < 0 || point.v_px > info.height;
  });
  if (static_cast<double>(outside) <= kMaxShare * static_cast<double>(tracks.size())) return;
  throw CommandError(
      kExitUsage,
      fmt::format("{}: {} of {} tracked points lie outside the {}x{} px of recording.yaml; give "
                  "the size of the image in which they were tracked",
                  (fs::path(directory) / "tracks.csv").string(), outside, tracks.size(), info.width,
                  info.height));
}

struct Tables {
  std::vector<FrameStamp> frames;
  std::vector<PanTiltSample> telemetry;
  std::vector<TrackPoint> tracks;
};

std::vector<ZoomReading> zoom_readings(const std::vector<PanTiltSample>& telemetry) {
  std::vector<ZoomReading> readings;
  for (const PanTiltSample& sample : telemetry) {
    if (sample.zoom) readings.push_back({sample.latest_time_s, *sample.zoom});
  }
  return readings;
}

// Sets the zoom of each dwell to its median reading, as the first one may differ from the rest.
void set_levels(const std::vector<ZoomReading>& readings, std::vector<ZoomStretch>* stretches) {
  for (ZoomStretch& stretch : *stretches) {
    std::vector<double> zooms;
    for (const ZoomReading& reading : readings) {
      if (reading.time_s >= stretch.begin_s && reading.time_s <= stretch.end_s)
        zooms.push_back(reading.zoom);
    }
    stretch.zoom = median(std::move(zooms));
  }
}

struct Span {
  double begin_s;
  double end_s;
  [[nodiscard]] bool holds(double time_s) const { return time_s >= begin_s && time_s <= end_s; }
};

// Keeps the tracks of those frames that lie in `frames` and in `tracks`.
Tables part_of(const Tables& all, const Span& frames, const Span& telemetry, const Span& tracks) {
  Tables part;
  std::unordered_set<std::int64_t> names;
  for (const FrameStamp& frame : all.frames) {
    if (!frames.holds(frame.receive_time_s)) continue;
    part.frames.push_back(frame);
    if (tracks.holds(frame.receive_time_s)) names.insert(frame.frame);
  }
  for (const PanTiltSample& sample : all.telemetry) {
    if (telemetry.holds(sample.latest_time_s)) part.telemetry.push_back(sample);
  }
  for (const TrackPoint& point : all.tracks) {
    if (names.count(point.frame) > 0) part.tracks.push_back(point);
  }
  return part;
}

Tables part_of(const Tables& all, const ZoomStretch& stretch) {
  const Span frames{stretch.begin_s + kZoomMargin_s, stretch.end_s - kZoomMargin_s};
  return part_of(all, frames, {stretch.begin_s, stretch.end_s}, frames);
}

void fill(Tables tables, CalibrationJob* job);

// Stores the movement from one dwell to the next in *to_job. Does nothing without tracks of it and
// without a video in which they could be found.
void add_movement(const Tables& all, const ZoomStretch& from, const ZoomStretch& to,
                  CalibrationJob job, CalibrationJob* to_job) {
  const Span all_of_it{from.begin_s, to.end_s};
  const Span tracked{from.end_s - 2 * kZoomMargin_s, to.begin_s + 2 * kZoomMargin_s};
  Tables part = part_of(all, all_of_it, all_of_it, tracked);
  if (part.tracks.empty() && !job.tracks_from_video) return;
  ZoomMovement movement;
  movement.from = from;
  movement.to = to;
  const bool polled = is_polled(part.telemetry);
  for (const PanTiltSample& sample : part.telemetry) {
    if (sample.zoom) movement.readings.push_back({stamp_of(sample, polled), *sample.zoom});
  }
  if (job.tracks_from_video && to.begin_s - from.end_s <= kLongestMovement_s) {
    CalibrationInput& pictures = to_job->movement_pictures;
    pictures.width = job.input.width;
    pictures.height = job.input.height;
    for (const FrameStamp& frame : part.frames) {
      if (tracked.holds(frame.receive_time_s))
        pictures.frames.push_back({frame.frame, frame.receive_time_s, {}});
    }
  }
  fill(std::move(part), &job);
  movement.input = std::move(job.input);
  movement.image_stamps = job.options.image_stamps;
  movement.telemetry_stamps = job.options.telemetry_stamps;
  to_job->movement = std::move(movement);
}

void fill(Tables tables, CalibrationJob* job) {
  add_frames(std::move(tables.frames), &job->input, &job->options, &job->remarks);
  add_telemetry(std::move(tables.telemetry), &job->input, &job->options, &job->remarks);
  for (const TrackPoint& point : tables.tracks) {
    job->input.observations.push_back(
        {point.frame, point.landmark, point.u_px, point.v_px, point.sigma_px});
  }
}

}  // namespace

std::vector<CalibrationJob> load_calibration_jobs(const std::string& directory,
                                                  std::optional<double> zoom_tolerance) {
  const auto require = [](bool ok, const std::string& error) {
    if (!ok) throw CommandError(kExitUsage, error);
  };
  const auto require_file = [&](const char* name, const std::string& why) {
    require(fs::exists(fs::path(directory) / name),
            fmt::format("{}: no {} in it; {}", directory, name, why));
  };
  std::string error;
  RecordingInfo info;
  require(read_recording_info(directory, &info, &error), error);
  require_file("frames.csv", "a calibration needs the time of each frame");
  require_file("telemetry.csv", "a calibration needs what the head reported");

  CalibrationJob job;
  job.recording = directory;
  job.tracks_from_video = !fs::exists(fs::path(directory) / "tracks.csv") && has_video(directory);
  if (!job.tracks_from_video) {
    require_file("tracks.csv",
                 fmt::format("a calibration needs keypoint tracks ({}), or the video (video.mkv or "
                             "frames/) to find them in",
                             tracks_csv_columns()));
  }
  job.input.width = info.width;
  job.input.height = info.height;
  RecordingNoise noise;
  require(load_noise(directory, &noise, &error), error);
  job.input.noise = static_cast<const CalibrationNoise&>(noise);
  if (noise.pan_tilt_scale_sigma) {
    job.options.pan_scale.sigma = *noise.pan_tilt_scale_sigma;
    job.options.tilt_scale.sigma = *noise.pan_tilt_scale_sigma;
  }
  job.options.angle_accuracy_rad = noise.pan_tilt_accuracy_rad.value_or(0);
  require(load_values((fs::path(directory) / "guess.yaml").string(), &job.guess, &error), error);

  Tables tables;
  require(read_frames_csv(directory, &tables.frames, &error), error);
  require(read_telemetry_csv(directory, &tables.telemetry, &error), error);
  if (!job.tracks_from_video) {
    require(read_tracks_csv(directory, &tables.tracks, &error), error);
    check_size(directory, info, tables.tracks);
  }
  const ZoomJitter jitter = steady_zoom(zoom_tolerance, &tables.telemetry);
  if (jitter.sigma > 0) {
    job.remarks.push_back(fmt::format(
        "telemetry.csv: the zoom reading jitters by {:.2g} (one standard deviation), so readings "
        "up to {:.2g} apart are taken for one zoom; --zoom-tolerance sets another limit",
        jitter.sigma, jitter.tolerance));
  }
  const std::vector<ZoomReading> readings = zoom_readings(tables.telemetry);
  const std::vector<ZoomStretch> all = find_zoom_stretches(readings, {jitter.tolerance});
  if (all.size() <= 1) {
    if (!all.empty()) job.zoom = all.front().zoom;
    fill(tables, &job);
    return {job};
  }
  std::vector<ZoomStretch> stretches = find_zoom_stretches(
      readings, {jitter.tolerance, ZoomStretchOptions().glitch_s, kZoomRestLeast_s});
  require(
      !stretches.empty(),
      fmt::format("{}: the zoom reading never stands still for {:g} s; dwell at each of {} zooms "
                  "or more for {:g} s and more while the camera pans and tilts{}",
                  directory, kZoomRestLeast_s, kZoomsAsked, kCalibrationAsked_s,
                  zoom_tolerance ? "" : ", or give --zoom-tolerance to a reading that flickers"));
  if (jitter.sigma > 0) set_levels(readings, &stretches);
  if (stretches.size() == 1) {
    job.remarks.push_back(fmt::format("the zoom moves: only the {:.0f} s at reading {:g} are used",
                                      stretches.front().end_s - stretches.front().begin_s,
                                      stretches.front().zoom));
  }
  std::vector<CalibrationJob> jobs;
  for (const ZoomStretch& stretch : stretches) {
    jobs.push_back(job);
    jobs.back().zoom = stretch.zoom;
    fill(part_of(tables, stretch), &jobs.back());
    if (jobs.size() > 1) {
      const ZoomStretch& before = stretches[jobs.size() - 2];
      add_movement(tables, before, stretch, job, &jobs.back());
    }
  }
  return jobs;
}

}  // namespace alidade
