#include "edge_app/commands/video_tracks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <memory>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/start_up/start_up_tracker.h"
#include "edge_app/commands/command.h"
#include "edge_app/self_calibration/keyframe_map.h"
#include "edge_app/step/calibration_feed.h"
#include "edge_app/step/orientation_step.h"
#include "platform/system/text.h"
#include "platform/video/recording_frame_source.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr int kPoints = 250;  // in a frame
// px, sigma of the first trajectory's angles in the image. OE mode weighs these angles against what
// it sees. So they are given only the accuracy that is needed to predict the image.
constexpr double kFirstSigma_px = 1;

// Calls use(frame, image) for each image of the input's frames, in the order of the recording.
template <class Use>
void for_each_image(const std::string& directory, const CalibrationInput& input,
                    const VideoProgress& progress, std::vector<std::string>* remarks, Use use) {
  std::unordered_set<std::int64_t> wanted;
  for (const CalibrationFrame& frame : input.frames) wanted.insert(frame.frame);
  const auto video = open_recorded_frames({directory, true, false});
  std::size_t done = 0;
  for (;;) {
    Frame frame;
    const ReadStatus status = video->read(frame, std::numeric_limits<double>::infinity());
    if (status == ReadStatus::kEnd) break;
    if (status != ReadStatus::kOk) throw CommandError(kExitFailed, video->error());
    if (wanted.count(frame.stamp.frame) == 0) continue;
    use(frame.stamp.frame, ImageView{frame.luma, frame.width, frame.height, frame.stride});
    progress(static_cast<double>(++done) / static_cast<double>(wanted.size()));
  }
  if (done == 0)
    throw CommandError(kExitFailed, directory + ": no picture of its video can be read");
  for (const std::string& remark : video->remarks()) remarks->push_back(remark);
  if (video->damaged_frames() > 0) {
    remarks->push_back(
        fmt::format("video: {} could not be decoded", counted(video->damaged_frames(), "picture")));
  }
  if (video->missing_frames() > 0) {
    remarks->push_back(fmt::format("video: ends {} before frames.csv does",
                                   counted(video->missing_frames(), "frame")));
  }
}

}  // namespace

bool has_video(const std::string& directory) {
  return fs::exists(fs::path(directory) / "video.mkv") ||
         fs::is_directory(fs::path(directory) / "frames");
}

VideoTracks track_video(const std::string& directory, const CalibrationInput& input,
                        const VideoProgress& progress) {
  StartUpOptions options;
  options.width = input.width;
  options.height = input.height;
  options.max_points = kPoints;
  StartUpTracker tracker(options);
  VideoTracks tracks;
  for_each_image(
      directory, input, progress, &tracks.remarks, [&](std::int64_t frame, const ImageView& image) {
        if (tracker.process(image) == StartUpStatus::kBadImage) {
          throw CommandError(
              kExitFailed, fmt::format("{}: pictures of {}x{} px are too small to follow points in",
                                       directory, image.width, image.height));
        }
        if (tracker.observation_count() == 0) tracks.without[frame] = Untracked::kNoPoint;
        for (int i = 0; i < tracker.observation_count(); ++i) {
          const TrackObservation& seen = tracker.observations()[i];
          tracks.observations.push_back({frame, seen.landmark, seen.u.x(), seen.u.y(), seen.sigma});
        }
      });
  return tracks;
}

VideoTracks track_video(const std::string& directory, const CalibrationInput& input,
                        const CalibrationResult& estimate, const VideoProgress& progress) {
  std::unordered_map<std::int64_t, double> times;
  for (const FrameResult& frame : estimate.frames) times[frame.frame] = frame.time_s;
  OeOptions options;
  options.max_width = input.width;
  options.max_height = input.height;
  options.search.choice.max_chosen = kPoints;
  options.maker.cell_size_px =
      std::max(LandmarkMakerOptions::kLeastCellSize_px,
               std::sqrt(static_cast<double>(input.width) * input.height / kPoints));
  const std::unique_ptr<OeMode> mode = make_oe_mode(options);
  mode->reset(estimate.calibration);
  const double to_middle_s = estimate.calibration.line_delay * input.height / 2;
  VideoTracks tracks;
  for_each_image(
      directory, input, progress, &tracks.remarks, [&](std::int64_t frame, const ImageView& image) {
        const auto time = times.find(frame);
        if (time == times.end()) {
          tracks.without[frame] = Untracked::kNoTelemetry;
          return;
        }
        const InterpolatedPanTilt prediction =
            predict(estimate, time->second + to_middle_s, kFirstSigma_px);
        FrameOrientation orientation;
        const OeStatus status = mode->process(image, time->second, &prediction, &orientation);
        const std::size_t before = tracks.observations.size();
        // Whether what was found moves, the calibration says.
        const bool found_any = status == OeStatus::kOk || status == OeStatus::kSceneMoves;
        for (int i = 0; found_any && i < mode->statistics().found; ++i) {
          const OeObservation& found = mode->observations()[i];
          if (const auto sigma = track_sigma(found))
            tracks.observations.push_back({frame, found.id, found.u.x(), found.u.y(), *sigma});
        }
        if (tracks.observations.size() == before) tracks.without[frame] = Untracked::kNoPoint;
        mode->maintain();
      });
  return tracks;
}

MapState map_video(const std::string& directory, const CalibrationResult& result,
                   const VideoProgress& progress) {
  CalibrationInput chosen;
  std::unordered_map<std::int64_t, double> times;
  const std::size_t frames = result.frames.size();
  const std::size_t count = std::min(frames, kMaxKeyframes);
  for (std::size_t i = 0; i < count; ++i) {
    const FrameResult& frame = result.frames[(2 * i + 1) * frames / (2 * count)];
    chosen.frames.push_back({frame.frame, frame.time_s, {}});
    times[frame.frame] = frame.time_s;
  }
  std::vector<Keyframe> keyframes;
  std::vector<std::string> said_before;
  for_each_image(directory, chosen, progress, &said_before,
                 [&](std::int64_t frame, const ImageView& image) {
                   keyframes.push_back({times.at(frame), std::make_shared<PackedImage>(image)});
                 });
  return map_from_keyframes(result, keyframes);
}

}  // namespace alidade
