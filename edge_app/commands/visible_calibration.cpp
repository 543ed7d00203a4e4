#include "edge_app/commands/visible_calibration.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdint>
#include <unordered_set>
#include <utility>
#include <vector>

#include "edge_app/commands/command.h"
#include "edge_app/commands/video_tracks.h"
#include "edge_app/self_calibration/track_choice.h"

namespace alidade {
namespace {

constexpr double kShareOfLooking = 0.9;  // share of finding tracks in the time with the adjustment

// Shows the progress on a terminal. The first SIGINT or SIGTERM cancels at the next step; the
// second ends the process at once.
class VisibleProgress {
 public:
  VisibleProgress(const std::string& name, StopSignals* signals) : name_(name), signals_(signals) {}
  VisibleProgress(const VisibleProgress&) = delete;
  VisibleProgress& operator=(const VisibleProgress&) = delete;
  ~VisibleProgress() {
    if (show_) fmt::print(stderr, "\r\033[K");
  }

  // From now on show(0) is `begin` and show(1) is `end` of the whole, 0 to 1.
  void set_part(double begin, double end) {
    begin_ = begin;
    end_ = end;
  }
  // Returns false if the user cancelled.
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

// begin: how much of the current part is done already, 0 to 1.
KnownCameraCalibration calibrate_visibly(const CalibrationJob& job, double begin,
                                         VisibleProgress* progress) {
  CalibrationOptions options = job.options;
  options.progress = [begin, progress](double done, const char* what) {
    return progress->show(begin + (1 - begin) * done, what);
  };
  KnownCameraCalibration calibrated = calibrate_knowing(job.input, options, job.known);
  if (calibrated.result.status == CalibrationStatus::kCancelled) throw progress->cancelled();
  return calibrated;
}

// Puts as many of the found tracks into the job as an adjustment can take, and notes the frames
// that are left without one.
void use_tracks(VideoTracks tracks, CalibrationJob* job) {
  UntrackedFrames found = std::move(tracks.without);
  const std::size_t before = without_shared_pixels(tracks.observations).size();
  job->input.observations = choose_tracks(std::move(tracks.observations), kMaxObservations, &found);
  std::unordered_set<std::int64_t> seen;
  for (const CalibrationObservation& one : job->input.observations) seen.insert(one.frame);
  UntrackedFrames& untracked = job->untracked.emplace();
  for (const CalibrationFrame& frame : job->input.frames) {
    if (seen.count(frame.frame) > 0) continue;
    const auto why = found.find(frame.frame);
    untracked[frame.frame] = why == found.end() ? Untracked::kNoPicture : why->second;
  }
  if (before <= kMaxObservations) return;
  spdlog::info(
      "video: {} of {} observations are used, of the points that moved farthest; more take long "
      "and tell little",
      job->input.observations.size(), before);
}

// Finds tracks, with a first estimate unless `estimate` is null, and calibrates with them.
KnownCameraCalibration calibrate_video(const CalibrationResult* estimate, CalibrationJob* job,
                                       std::vector<std::string>* remarks,
                                       VisibleProgress* progress) {
  const VideoProgress look = [progress, estimate](double done) {
    const char* what = estimate == nullptr ? "following points in the video"
                                           : "following points again, with the estimated camera";
    // Finding tracks takes nearly all of the time.
    if (!progress->show(kShareOfLooking * done, what)) throw progress->cancelled();
  };
  VideoTracks tracks = estimate == nullptr
                           ? track_video(job->recording, job->input, look)
                           : track_video(job->recording, job->input, *estimate, look);
  *remarks = std::move(tracks.remarks);
  use_tracks(std::move(tracks), job);
  return calibrate_visibly(*job, kShareOfLooking, progress);
}

}  // namespace

CalibrationResult calibrate_job(int passes, CalibrationJob* job, StopSignals* signals) {
  VisibleProgress progress(job->recording, signals);
  std::vector<std::string> remarks;
  const auto finish = [&](KnownCameraCalibration calibrated) {
    for (const auto* said : {&remarks, &calibrated.remarks})
      job->remarks.insert(job->remarks.end(), said->begin(), said->end());
    job->options = std::move(calibrated.options);
    job->options.progress = nullptr;
    return std::move(calibrated.result);
  };
  if (!job->tracks_from_video) return finish(calibrate_visibly(*job, 0, &progress));
  progress.set_part(0, passes > 1 ? 0.5 : 1);
  KnownCameraCalibration first = calibrate_video(nullptr, job, &remarks, &progress);
  if (job->input.observations.empty()) {
    throw CommandError(
        kExitFailed,
        fmt::format(
            "{}: no point of the video could be followed through {} frames; film a far scene "
            "with texture, lit and in focus, that stays in view for that long",
            job->recording, kMinSightings));
  }
  const bool usable = first.result.ok() || first.result.status == CalibrationStatus::kWeak;
  if (passes > 1 && usable) {
    const std::vector<CalibrationObservation> first_tracks = job->input.observations;
    const auto first_untracked = job->untracked;
    progress.set_part(0.5, 1);
    KnownCameraCalibration second = calibrate_video(&first.result, job, &remarks, &progress);
    if (second.result.ok() || !first.result.ok()) {
      first = std::move(second);
    } else {
      job->input.observations = first_tracks;
      job->untracked = first_untracked;
      remarks.push_back(
          fmt::format("the second look at the video gave no calibration ({}: {}), so this one is "
                      "from the first look",
                      to_string(second.result.status), second.result.message));
    }
  }
  return finish(std::move(first));
}

void track_movement(CalibrationJob* job, StopSignals* signals) {
  if (job->movement_pictures.frames.empty()) return;
  VisibleProgress progress(job->recording, signals);
  VideoTracks tracks =
      track_video(job->recording, job->movement_pictures, [&progress](double done) {
        if (!progress.show(done, "following points while the zoom moves"))
          throw progress.cancelled();
      });
  job->movement->input.observations = choose_tracks(std::move(tracks.observations));
}

MapState map_visibly(const std::string& recording, const CalibrationResult& result,
                     StopSignals* signals) {
  VisibleProgress progress(recording, signals);
  return map_video(recording, result, [&progress](double done) {
    if (!progress.show(done, "looking at some pictures for the map")) throw progress.cancelled();
  });
}

}  // namespace alidade
