#include "edge_app/commands/pattern_video.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <utility>

#include "core/calibration/clock_line.h"
#include "core/pattern/pattern_detector.h"
#include "core/pattern/pattern_doubts.h"
#include "edge_app/commands/command.h"
#include "edge_app/pipeline/repeated_images.h"
#include "platform/video/recording_frame_source.h"
#include "platform/video/video_file.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

std::unique_ptr<FrameSource> open_video(const std::string& video) {
  std::error_code error;
  if (!fs::exists(video, error)) {
    throw CommandError(kExitFailed,
                       video + ": is not there; expected a recording's directory or a video file");
  }
  if (fs::is_directory(video, error)) return open_recorded_frames({video, true, false});
  return open_video_file(video);
}

// Row 0's exposure of each frame, on a steady clock where there is one.
void regularise(const std::string& path, const std::vector<FrameStamp>& stamps,
                PatternVideo* video) {
  internal::ClockInput clock;
  bool by_sender = true;
  for (const FrameStamp& stamp : stamps) by_sender = by_sender && stamp.sender_time_s.has_value();
  for (const FrameStamp& stamp : stamps) {
    clock.stamp_s.push_back(by_sender ? *stamp.sender_time_s : stamp.receive_time_s);
    clock.sequence.push_back(stamp.sequence);
  }
  clock.one_sided = !by_sender;
  for (std::size_t i = 1; i < clock.stamp_s.size(); ++i) {
    if (clock.stamp_s[i] > clock.stamp_s[i - 1]) continue;
    throw CommandError(
        kExitFailed,
        fmt::format("{}: time stamps do not increase: image {} is of {} s, the one before of {} s; "
                    "expected the video as the camera gave it, not cut or joined",
                    path, stamps[i].frame, clock.stamp_s[i], clock.stamp_s[i - 1]));
  }
  const internal::ClockLine line = internal::fit_clock_line(clock);
  for (std::size_t i = 0; i < stamps.size(); ++i) video->data.frames[i].time_s = line.time_s[i];
  video->lost = line.lost;
  if (!line.steady) {
    video->remarks.emplace_back(
        "the frame rate is not steady; time stamps are taken as they are, and their errors are not "
        "part of any sigma: fix the frame rate, and the exposure with it");
  }
  constexpr double kMuchJitter = 0.1;  // of a period
  if (line.steady && line.stamp_sigma_s > kMuchJitter * line.period_s) {
    video->remarks.push_back(
        fmt::format("time stamps scatter by {:.1f} ms about a steady rate of {:.2f} frames a "
                    "second; if the frame "
                    "rate varies in truth, fix it, and the exposure with it",
                    1e3 * line.stamp_sigma_s, 1 / line.period_s));
  }
  if (line.lost > 0)
    video->remarks.push_back(fmt::format("{} images are missing by their time stamps", line.lost));
}

}  // namespace

PatternVideo find_pattern(const std::string& path, const KnownPattern& pattern,
                          const std::function<bool(int images, int found)>& progress) {
  const std::unique_ptr<FrameSource> source = open_video(path);
  PatternVideo video;
  video.data.points_m = pattern.points_m();
  PatternDetector detector(pattern);
  std::optional<std::uint64_t> before;  // digest of the image before
  std::vector<FrameStamp> stamps;
  bool interlaced = false;
  for (;;) {
    Frame frame;
    const ReadStatus status = source->read(frame, std::numeric_limits<double>::infinity());
    if (status == ReadStatus::kEnd) break;
    if (status != ReadStatus::kOk) throw CommandError(kExitFailed, source->error());
    if (frame.luma == nullptr)
      throw CommandError(kExitFailed, path + ": holds no images; expected video.mkv or frames/");
    if (video.images == 0) {
      video.data.width = frame.width;
      video.data.height = frame.height;
    }
    if (std::min(frame.width, frame.height) < PatternDetector::kLeastImage_px) {
      throw CommandError(
          kExitFailed,
          fmt::format(
              "{}: its images are {}x{} px, too small for a pattern; expected {} px or more a "
              "side, better several hundred",
              path, frame.width, frame.height, PatternDetector::kLeastImage_px));
    }
    interlaced = interlaced || frame.interlaced;
    if (frame.width != video.data.width || frame.height != video.data.height) {
      throw CommandError(
          kExitFailed,
          fmt::format("{}: image {} is {}x{}, those before are {}x{}; expected one size", path,
                      video.images, frame.width, frame.height, video.data.width,
                      video.data.height));
    }
    ++video.images;
    const std::uint64_t digest =
        image_digest({frame.luma, frame.width, frame.height, frame.stride});
    if (std::exchange(before, digest) == digest) {
      ++video.repeated;
      continue;
    }
    PatternFrame found;
    found.observations = detector.find(frame.luma, frame.width, frame.height, frame.stride);
    video.found += found.observations.empty() ? 0 : 1;
    video.data.frames.push_back(std::move(found));
    stamps.push_back(frame.stamp);
    if (!progress(video.images, video.found))
      throw CommandError(kExitFailed, path + ": interrupted; nothing stored");
  }
  if (stamps.size() < 3)
    throw CommandError(kExitFailed, fmt::format("{}: {} images; a video of some 30 s is needed",
                                                path, stamps.size()));
  regularise(path, stamps, &video);
  const double interval_s = (video.data.frames.back().time_s - video.data.frames.front().time_s) /
                            static_cast<double>(stamps.size() - 1);
  follow_half_turns(pattern, 10 * interval_s, &video.data);
  if (interlaced) video.remarks.emplace_back(kInterlaced);
  for (const std::string& remark : doubts_of(video.data)) video.remarks.push_back(remark);
  if (!detector.doubt().empty()) video.remarks.push_back(detector.doubt());
  if (video.repeated > 0)
    video.remarks.push_back(
        fmt::format("{} images repeat the one before and are left out", video.repeated));
  return video;
}

}  // namespace alidade
