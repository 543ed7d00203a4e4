#include "test/accuracy/tracked_scene.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>

namespace alidade::test {

namespace {

Eigen::Matrix3d picture_from_space(const SceneFrame& frame, const SceneFrame& first,
                                   TrackingSpace space) {
  switch (space) {
    case TrackingSpace::kPlane:
      return frame.H_picture_from_plane();
    case TrackingSpace::kMosaic:
      return frame.P.leftCols<3>() * first.P.leftCols<3>().inverse();
    case TrackingSpace::kPicture:
      break;
  }
  return Eigen::Matrix3d::Identity();
}

MotBox mot_box(std::size_t frame, std::uint64_t identity, const SceneBox& box) {
  return {static_cast<std::int64_t>(frame) + 1,
          static_cast<std::int64_t>(identity),
          box.left,
          box.top,
          box.width,
          box.height};
}

}  // namespace

TargetTrackerOptions tracker_for(TrackingSpace space, SceneKind kind) {
  TargetTrackerOptions options;
  const bool hockey = kind == SceneKind::kHockey;
  options.acceleration_density = hockey ? 2 : 0.3;
  options.sigma_first_velocity = hockey ? 4 : 1.5;
  if (space != TrackingSpace::kPlane) {
    // Pixels a metre, across the line of sight, in the middle of the plane; the camera's own motion in the picture comes on top.
    const double scale = hockey ? 25 : 40;
    options.acceleration_density *= scale * scale;
    options.sigma_first_velocity *= scale;
    options.most_sigma = 1000;
    if (space == TrackingSpace::kPicture) {
      options.acceleration_density += 2000;
      options.sigma_first_velocity += 60;
    }
  }
  return options;
}

TrackedScene track_scene(const std::vector<SceneFrame>& frames, double noise_px,
                         double false_alarms, TrackingSpace space,
                         const TargetTrackerOptions& options) {
  TrackedScene scene;
  TargetTracker tracker(options);
  std::map<std::uint64_t, int> person_of;
  std::vector<TargetMeasurement> detections;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const SceneFrame& frame = frames[k];
    detections.clear();
    for (const SceneDetection& detection : frame.detections) {
      detections.push_back({detection.pixel, noise_px * noise_px * Matrix2<double>::Identity()});
    }
    TargetFrame told;
    told.time_s = frame.time_s;
    told.H_measured_from_world = picture_from_space(frame, frames.front(), space);
    told.view = picture_region(kSceneWidth, kSceneHeight);
    told.false_alarm_density = std::max(false_alarms, 0.01) / (kSceneWidth * kSceneHeight);
    told.detections = detections.data();
    told.count = static_cast<int>(detections.size());
    if (frame.has_pose && tracker.add(told, frame.time_s).status != FrameStatus::kTaken) continue;

    for (std::size_t i = 0; i < frame.targets.size(); ++i) {
      if (!frame.targets[i].in_view) continue;
      scene.truth.push_back(mot_box(k, i + 1, box_at(frame, frame.targets[i].place)));
    }
    if (!frame.has_pose) continue;
    const Eigen::Matrix3d plane_from_picture = frame.H_picture_from_plane().inverse();
    for (const Target& target : tracker.targets()) {
      if (target.identity == 0 || target.in_view <= 0.5) continue;
      const auto expected = expected_place(options.space, target.state, told.H_measured_from_world);
      if (!expected) continue;
      const Eigen::Vector3d place = plane_from_picture * expected->place.homogeneous();
      const SceneBox box = box_at(frame, place.hnormalized());
      if (!(box.width > 0 && box.height > 0)) continue;
      scene.result.push_back(mot_box(k, target.identity, box));

      if (target.detection >= 0) {
        const int person = frame.detections[static_cast<std::size_t>(target.detection)].target;
        if (person >= 0) person_of[target.identity] = person;
      }
      const auto person = person_of.find(target.identity);
      if (space != TrackingSpace::kPlane || person == person_of.end()) continue;
      const SceneTarget& truth = frame.targets[static_cast<std::size_t>(person->second)];
      const Vector2<double> error = target.state.mean.head<2>() - truth.place;
      const Matrix2<double> cov = target.state.cov.topLeftCorner<2, 2>();
      const double nees = error.dot(cov.inverse() * error);
      if (k % 25 == 24) scene.nees.push_back(nees);
      if (k + 1 == frames.size()) scene.last_nees.push_back(nees);
    }
  }
  return scene;
}

void append_scene(const TrackedScene& scene, TrackedScene* all) {
  std::int64_t frames = 0;
  std::int64_t identities = 0;
  for (const auto* boxes : {&all->truth, &all->result}) {
    for (const MotBox& box : *boxes) {
      frames = std::max(frames, box.frame);
      identities = std::max(identities, box.identity);
    }
  }
  const auto add = [&](const std::vector<MotBox>& from, std::vector<MotBox>* to) {
    for (MotBox box : from) {
      box.frame += frames;
      box.identity += identities;
      to->push_back(box);
    }
  };
  add(scene.truth, &all->truth);
  add(scene.result, &all->result);
  all->nees.insert(all->nees.end(), scene.nees.begin(), scene.nees.end());
  all->last_nees.insert(all->last_nees.end(), scene.last_nees.begin(), scene.last_nees.end());
}

}  // namespace alidade::test
