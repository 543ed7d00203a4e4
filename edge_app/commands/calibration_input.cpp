#include "edge_app/commands/calibration_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "edge_app/commands/command.h"
#include "edge_app/commands/video_tracks.h"
#include "edge_app/config/noise_file.h"
#include "platform/recording/recording.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;
using Counts = std::vector<std::optional<std::int64_t>>;

// Leaves the longest part without a reconnection.
template <class Item>
void keep_longest_part(const char* what, std::vector<Item>* items,
                       std::vector<std::string>* remarks) {
  std::size_t best_begin = 0;
  std::size_t best_end = 0;
  for (std::size_t begin = 0; begin < items->size();) {
    std::size_t end = begin + 1;
    while (end < items->size() && !(*items)[end].restarted) ++end;
    if (end - begin > best_end - best_begin) {
      best_begin = begin;
      best_end = end;
    }
    begin = end;
  }
  if (best_end - best_begin == items->size()) return;
  remarks->push_back(
      fmt::format("{}: the connection was lost; the longest part without that is "
                  "used, {} of {}",
                  what, best_end - best_begin, items->size()));
  *items = std::vector<Item>(items->begin() + static_cast<std::ptrdiff_t>(best_begin),
                             items->begin() + static_cast<std::ptrdiff_t>(best_end));
}

// The count of each time on its steady grid; empty if they do not lie on one.
std::vector<std::int64_t> count_on_grid(const std::vector<double>& times) {
  constexpr double kMaxDistance = 0.25;  // of the period
  if (times.size() < 3) return {};
  std::vector<double> steps;
  for (std::size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  double period = *middle;
  if (!(period > 0)) return {};
  // Counted from one item to the next, which an error of the period does not harm; then checked on the
  // grid of the whole.
  std::vector<std::int64_t> counts = {0};
  for (std::size_t i = 1; i < times.size(); ++i) {
    const double step = std::round((times[i] - times[i - 1]) / period);
    if (!(step >= 1) || step > 1e6) return {};
    counts.push_back(counts.back() + static_cast<std::int64_t>(step));
  }
  period = (times.back() - times.front()) / static_cast<double>(counts.back());
  for (std::size_t i = 0; i < times.size(); ++i) {
    const double expected = times.front() + period * static_cast<double>(counts[i]);
    if (std::abs(times[i] - expected) > kMaxDistance * period) return {};
  }
  return counts;
}

// sequence(item) and sender_time(item) are optionals.
template <class Item, class Sequence, class SenderTime>
Counts count_items(const std::vector<Item>& items, Sequence sequence, SenderTime sender_time) {
  const auto all = [&items](auto has) { return std::all_of(items.begin(), items.end(), has); };
  Counts counts;
  if (all([&](const Item& item) { return sequence(item).has_value(); })) {
    for (const Item& item : items) counts.push_back(sequence(item));
  } else if (all([&](const Item& item) { return sender_time(item).has_value(); })) {
    std::vector<double> times;
    for (const Item& item : items) times.push_back(*sender_time(item));
    for (const std::int64_t count : count_on_grid(times)) counts.emplace_back(count);
  }
  counts.resize(items.size());
  return counts;
}

void add_frames(std::vector<FrameStamp> stamps, CalibrationJob* job) {
  keep_longest_part("frames.csv", &stamps, &job->remarks);
  const Counts counts = count_items(
      stamps, [](const FrameStamp& stamp) { return stamp.sequence; },
      [](const FrameStamp& stamp) { return stamp.sender_time_s; });
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    job->input.frames.push_back({stamps[i].frame, stamps[i].receive_time_s, counts[i]});
  }
  job->options.image_stamps =
      job->input.noise.image_stamp_sigma_s ? StampNoise::kSymmetric : StampNoise::kOneSided;
}

void add_telemetry(std::vector<PanTiltSample> samples, CalibrationJob* job) {
  const bool polled = std::none_of(samples.begin(), samples.end(), [](const PanTiltSample& sample) {
    return sample.sequence.has_value() || sample.device_time_s.has_value();
  });
  // Polled samples bear the host's times, which go on over a reconnection.
  if (!polled) keep_longest_part("telemetry.csv", &samples, &job->remarks);
  const Counts counts = count_items(
      samples, [](const PanTiltSample& sample) { return sample.sequence; },
      [](const PanTiltSample& sample) { return sample.device_time_s; });
  double square_widths = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const PanTiltSample& sample = samples[i];
    const double width = sample.latest_time_s - sample.earliest_time_s;
    const double stamp = polled ? sample.latest_time_s - width / 2 : sample.latest_time_s;
    job->input.telemetry.push_back({stamp, sample.pan_rad, sample.tilt_rad, counts[i]});
    square_widths += width * width;
  }
  CalibrationNoise& noise = job->input.noise;
  if (polled && square_widths > 0 && !noise.telemetry_stamp_sigma_s) {
    noise.telemetry_stamp_sigma_s =
        std::sqrt(square_widths / static_cast<double>(samples.size()) / 12);
  }
  // Only an interval tells a poll from a stream whose device sends neither count nor time.
  job->options.telemetry_stamps = polled && square_widths > 0     ? StampNoise::kOwnTimes
                                  : noise.telemetry_stamp_sigma_s ? StampNoise::kSymmetric
                                                                  : StampNoise::kOneSided;
}

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
  const auto require_file = [&](const char* name, const char* why) {
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
                 "a calibration needs keypoint tracks (frame,landmark,u_px,v_px,sigma_px), or the "
                 "video (video.mkv or frames/) to find them in");
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
  add_frames(std::move(frames), &job);
  std::vector<PanTiltSample> telemetry;
  require(read_telemetry_csv(directory, &telemetry, &error), error);
  add_telemetry(std::move(telemetry), &job);
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
