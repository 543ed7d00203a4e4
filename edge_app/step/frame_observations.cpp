#include "edge_app/step/frame_observations.h"

#include <cmath>
#include <cstddef>

namespace alidade {
namespace {

void add_track(std::uint32_t landmark, const Vector2<double>& u, double sigma,
               FrameTracks* tracks) {
  if (tracks->count == kMaxFramePoints) return;
  tracks->points[static_cast<std::size_t>(tracks->count++)] = {
      landmark, static_cast<float>(u.x()), static_cast<float>(u.y()), static_cast<float>(sigma)};
}

void add_landmark(const Vector2<double>& expected, const Vector2<double>& residual, bool inlier,
                  FrameLandmarks* landmarks) {
  if (landmarks->count == kMaxFramePoints) return;
  landmarks->found[static_cast<std::size_t>(landmarks->count++)] = {
      static_cast<float>(expected.x()), static_cast<float>(expected.y()),
      static_cast<float>(residual.x()), static_cast<float>(residual.y()), inlier};
}

}  // namespace

void get_tracks(const StartUpTracker& tracker, FrameTracks* tracks) {
  tracks->count = 0;
  for (int i = 0; i < tracker.observation_count(); ++i) {
    const TrackObservation& point = tracker.observations()[i];
    add_track(point.landmark, point.u, point.sigma, tracks);
  }
}

void get_tracks(const OeMode& mode, FrameTracks* tracks) {
  const OeStatistics& statistics = mode.statistics();
  tracks->count = 0;
  tracks->oe_status = statistics.status;
  for (int i = 0; statistics.status == OeStatus::kOk && i < statistics.found; ++i) {
    const OeObservation& landmark = mode.observations()[i];
    if (const auto sigma = track_sigma(landmark))
      add_track(landmark.id, landmark.u, *sigma, tracks);
  }
}

void get_landmarks(const StartUpTracker& tracker, FrameLandmarks* landmarks) {
  landmarks->kind = FrameLandmarks::Kind::kPoints;
  landmarks->count = 0;
  for (int i = 0; i < tracker.observation_count(); ++i)
    add_landmark(tracker.observations()[i].u, Vector2<double>::Zero(), true, landmarks);
}

void get_landmarks(const OeMode& mode, FrameLandmarks* landmarks) {
  landmarks->kind = FrameLandmarks::Kind::kNone;
  landmarks->count = 0;
  if (mode.statistics().status != OeStatus::kOk) return;
  landmarks->kind = FrameLandmarks::Kind::kLandmarks;
  for (int i = 0; i < mode.statistics().found; ++i) {
    const OeObservation& landmark = mode.observations()[i];
    const Vector2<double> residual = observed_residual(landmark);
    add_landmark(landmark.u - residual, residual, landmark.inlier, landmarks);
  }
}

std::optional<double> residual_rms(const OeMode& mode) {
  double sum = 0;
  int count = 0;
  for (int i = 0; i < mode.statistics().found; ++i) {
    const OeObservation& landmark = mode.observations()[i];
    if (!landmark.inlier) continue;
    sum += observed_residual(landmark).squaredNorm();
    ++count;
  }
  if (count == 0) return std::nullopt;
  return std::sqrt(sum / count);
}

}  // namespace alidade
