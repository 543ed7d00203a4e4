#include "edge_app/commands/calibration_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "edge_app/commands/command.h"
#include "edge_app/commands/video_tracks.h"
#include "edge_app/config/noise_file.h"
#include "edge_app/pipeline/calibration_streams.h"
#include "platform/storage/recording.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

// Single points beyond the image are the calibration's business, many are another image's.
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

}  // namespace

CalibrationJob load_calibration_job(const std::string& directory) {
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
  job.input.noise = noise;
  if (noise.pan_tilt_scale_sigma) {
    job.options.pan_scale.sigma = *noise.pan_tilt_scale_sigma;
    job.options.tilt_scale.sigma = *noise.pan_tilt_scale_sigma;
  }
  require(load_values((fs::path(directory) / "guess.yaml").string(), &job.guess, &error), error);

  std::vector<FrameStamp> frames;
  require(read_frames_csv(directory, &frames, &error), error);
  add_frames(std::move(frames), &job.input, &job.options, &job.remarks);
  std::vector<PanTiltSample> telemetry;
  require(read_telemetry_csv(directory, &telemetry, &error), error);
  add_telemetry(std::move(telemetry), &job.input, &job.options, &job.remarks);
  if (job.tracks_from_video) return job;
  std::vector<TrackPoint> tracks;
  require(read_tracks_csv(directory, &tracks, &error), error);
  check_size(directory, info, tracks);
  for (const TrackPoint& point : tracks) {
    job.input.observations.push_back(
        {point.frame, point.landmark, point.u_px, point.v_px, point.sigma_px});
  }
  return job;
}

}  // namespace alidade
