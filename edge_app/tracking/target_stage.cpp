#include "edge_app/tracking/target_stage.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/ground/image_plane.h"
#include "edge_app/tracking/target_report.h"

namespace alidade {
namespace {

// If a box ends nearer to the picture's lower edge, its foot may lie below the edge.
constexpr double kFootMargin_px = 1;
// Limits how long class votes count.
constexpr double kMostClassWeight = 5;

DetectionStatus status_of(FrameStatus status) {
  switch (status) {
    case FrameStatus::kTaken:
      return DetectionStatus::kTaken;
    case FrameStatus::kTakenLate:
      return DetectionStatus::kTakenLate;
    case FrameStatus::kTooLate:
      return DetectionStatus::kTooLate;
    case FrameStatus::kInTheFuture:
      return DetectionStatus::kFrameNotYet;
    case FrameStatus::kTooManyDetections:
      return DetectionStatus::kTooManyBoxes;
    case FrameStatus::kBadFrame:
    case FrameStatus::kDetectionOutside:
    case FrameStatus::kDetectionNotFinite:
    case FrameStatus::kDetectionCovariance:
      break;
  }
  return DetectionStatus::kNoGeometry;
}

std::optional<BoxFault> fault_in_picture(const DetectionBox& box, const PlainCalibration& camera) {
  return fault_of(box, camera.width, camera.height);
}

}  // namespace

DetectionAnswer check_detections(const DetectedFrame& frame, const TargetOptions& options) {
  DetectionAnswer answer;
  if (!frame.record.frame || !frame.record.time_s || !frame.record.orientation) {
    answer.status = DetectionStatus::kNoOrientation;
    return answer;
  }
  if (frame.boxes.size() > static_cast<std::size_t>(options.tracker.max_detections)) {
    answer.status = DetectionStatus::kTooManyBoxes;
    return answer;
  }
  for (std::size_t i = 0; i < frame.boxes.size(); ++i) {
    if (const auto fault = fault_in_picture(frame.boxes[i], frame.record.camera))
      answer.left_out.push_back({i, *fault});
  }
  return answer;
}

TargetStage::TargetStage(const TargetOptions& options, std::shared_ptr<const PlaneEstimate> plane)
    : options_(options), plane_(std::move(plane)), tracker_(options.tracker) {}

DetectionAnswer TargetStage::add(const DetectedFrame& frame) {
  DetectionAnswer answer = take(frame);
  counters_.count(answer.status);
  counters_.births_refused = tracker_.births_refused();
  return answer;
}

// Chooses the usable boxes that have a place, and measures their places.
void TargetStage::choose(const DetectedFrame& frame, const FrameView& view) {
  chosen_.clear();
  measured_.clear();
  const double sigma_px = options_.detection_sigma_px;
  const Matrix2<double> cov_u = sigma_px * sigma_px * Matrix2<double>::Identity();
  for (const DetectionBox& box : frame.boxes) {
    if (const auto fault = fault_in_picture(box, frame.record.camera)) {
      ++counters_.boxes_unusable[static_cast<std::size_t>(*fault)];
      continue;
    }
    if (box.score < options_.least_score) {
      ++counters_.boxes_below_score;
      continue;
    }
    const Vector2<double> u = plane_ ? box.foot() : box.middle();
    if (plane_ && u.y() > frame.record.camera.height - kFootMargin_px) {
      ++counters_.boxes_cut_off;
      continue;
    }
    PlanePoint point;
    const bool has_place = !plane_ || plane_point_of_pixel(plane_->plane, view.frame(), u, cov_u,
                                                           {}, &point) == PlaneStatus::kOk;
    const auto measured = view.measure(u, sigma_px);
    if (!has_place || !measured) {
      ++counters_.boxes_without_place;
      continue;
    }
    chosen_.push_back(box);
    measured_.push_back(*measured);
  }
}

DetectionAnswer TargetStage::take(const DetectedFrame& frame) {
  DetectionAnswer answer = check_detections(frame, options_);
  if (!is_taken(answer.status)) return answer;
  const double time_s = *frame.record.time_s;
  if (std::find(taken_s_.begin(), taken_s_.end(), time_s) != taken_s_.end()) {
    answer.status = DetectionStatus::kRepeated;
    return answer;
  }
  const TargetCounters before = counters_;
  const FrameView view(frame.record);
  choose(frame, view);
  TargetFrame tracked;
  tracked.time_s = view.time_s();
  tracked.H_measured_from_world = view.H_measured_from_world(plane_ ? &plane_->plane : nullptr);
  tracked.view = view.region();
  tracked.false_alarm_density = options_.false_alarms / view.area_px2();
  tracked.detections = measured_.data();
  tracked.count = static_cast<int>(measured_.size());
  // A frame that has a record is not in the future.
  answer.status = status_of(tracker_.add(tracked, tracked.time_s).status);
  if (!is_taken(answer.status)) {
    counters_ = before;
    return answer;
  }
  counters_.boxes_taken += tracked.count;
  ++updates_;
  taken_s_.push_back(time_s);
  while (taken_s_.size() > static_cast<std::size_t>(options_.tracker.history_frames))
    taken_s_.pop_front();
  const bool newest = answer.status == DetectionStatus::kTaken;
  if (newest) {
    newest_ = frame.record;
    boxes_.swap(chosen_);
  }
  look_at_targets(newest);
  return answer;
}

void TargetStage::look_at_targets(bool newest) {
  std::map<std::uint64_t, TargetLook> kept;
  for (const Target& target : tracker_.targets()) {
    if (target.identity == 0) continue;
    const auto known = looks_.find(target.identity);
    kept[target.identity] = known == looks_.end() ? TargetLook() : std::move(known->second);
  }
  looks_ = std::move(kept);
  const FrameView view(newest_);
  const FrameOrientation shared = view.shared_frame();
  for (const Target& target : tracker_.targets()) {
    if (target.identity == 0 || target.detection < 0) continue;
    TargetLook& look = looks_[target.identity];
    // If a late frame changes the past, the newest frame's boxes need not be counted again.
    if (!newest && look.scale > 0) continue;
    const DetectionBox& box = boxes_[static_cast<std::size_t>(target.detection)];
    look.score = box.score;
    look.width = box.width;
    look.height = box.height;
    look.weight =
        std::min(kMostClassWeight, look.weight + (box.name == look.name ? box.score : -box.score));
    if (look.weight <= 0) {
      look.name = box.name;
      look.weight = -look.weight;
    }
    const Vector2<double> u = plane_ ? box.foot() : box.middle();
    static_cast<void>(shared_covariance(shared, plane_.get(), u, &look.shared_cov));
    look.scale = view.focal_length();
    if (plane_) {
      const Vector2<double> place = target.state.mean.head<2>();
      look.scale /= (Vector3<double>(place.x(), place.y(), 0) - plane_->plane.position).norm();
    }
  }
}

TargetsState TargetStage::state() const {
  TargetsState out;
  out.updates = updates_;
  out.space = options_.tracker.space;
  out.acceleration_density = options_.tracker.acceleration_density;
  out.plane = plane_;
  out.time_s = tracker_.time_s();
  out.record = newest_;
  for (const Target& target : tracker_.targets()) {
    const auto look = looks_.find(target.identity);
    if (look != looks_.end()) out.targets.push_back({target, look->second});
  }
  std::sort(out.targets.begin(), out.targets.end(),
            [](const auto& a, const auto& b) { return a.target.identity < b.target.identity; });
  out.counters = counters_;
  return out;
}

}  // namespace alidade
