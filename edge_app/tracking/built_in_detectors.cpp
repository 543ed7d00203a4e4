#include "edge_app/tracking/built_in_detectors.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace alidade {
namespace {

// All that a detector asks of a frame; the record's own geometry has what directions need alone.
bool complete_orientation(const OrientationRecord& record, FrameOrientation* out) {
  const FrameOrientation told = unpack(record.orientation->geometry, record.camera);
  if (!make_frame_orientation(told.calibration, *record.time_s, told.mode, record.landmarks,
                              told.motion(), told.motion_covariance, told.motion_sensitivity, out))
    return false;
  out->zoom_rate_sigma = told.zoom_rate_sigma;
  return true;
}

}  // namespace

BuiltInDetectors::BuiltInDetectors(const BuiltInDetectorOptions& options,
                                   std::shared_ptr<const PlaneEstimate> plane, TargetFeed& feed)
    : options_(options), plane_(std::move(plane)), feed_(feed) {
  if (options_.people) people_ = std::make_unique<PersonDetector>(*options_.people);
  if (options_.motion) report_.motion.emplace();
  if (options_.people) report_.people.emplace();
}

void BuiltInDetectors::count(std::optional<DetectorCounters>* counters, bool judged,
                             std::size_t boxes) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++(*counters)->pictures;
  if (!judged) ++(*counters)->unjudged;
  (*counters)->boxes += static_cast<std::int64_t>(boxes);
}

bool BuiltInDetectors::find_people(const ImageView& image, const FrameOrientation& orientation) {
  const bool judged = people_->find(image, orientation, plane_->plane) == PersonStatus::kOk;
  for (DetectionBox box : people_->boxes()) {
    box.score = 1 / (1 + std::exp(-box.score));
    box.name = "person";
    boxes_.push_back(std::move(box));
  }
  count(&report_.people, judged, people_->boxes().size());
  return judged;
}

bool BuiltInDetectors::find_motion(const ImageView& image, const FrameOrientation& orientation) {
  if (!motion_) {
    MotionOptions options = *options_.motion;
    options.width = image.width;
    options.height = image.height;
    // Too small or too large to be compared.
    if (!options.validate()) {
      count(&report_.motion, false, 0);
      return false;
    }
    motion_ = std::make_unique<MotionDetector>(options);
  }
  const bool judged = motion_->find(image, orientation).status == MotionStatus::kOk;
  const std::size_t people = boxes_.size();
  for (DetectionBox box : motion_->boxes()) {
    const Vector2<double> middle = box.middle();
    const bool is_person =
        std::any_of(boxes_.begin(), boxes_.begin() + static_cast<std::ptrdiff_t>(people),
                    [&middle](const DetectionBox& person) {
                      return middle.x() >= person.u && middle.x() <= person.u + person.width &&
                             middle.y() >= person.v && middle.y() <= person.v + person.height;
                    });
    if (is_person) continue;
    box.score = std::min(1.0, box.score / kMostChangeScore);
    boxes_.push_back(std::move(box));
  }
  count(&report_.motion, judged, motion_->boxes().size());
  return judged;
}

void BuiltInDetectors::look(const DetectableFrame& frame) {
  FrameOrientation orientation;
  if (!complete_orientation(frame.record, &orientation)) return;
  boxes_.clear();
  bool judged = false;
  if (people_) judged = find_people(frame.image, orientation);
  if (options_.motion) judged = find_motion(frame.image, orientation) || judged;
  if (!judged) return;
  const auto most = static_cast<std::size_t>(feed_.options().tracker.max_detections);
  if (boxes_.size() > most) boxes_.resize(most);
  // What becomes of it the feed counts.
  static_cast<void>(feed_.offer({frame.record, boxes_}));
}

DetectorsReport BuiltInDetectors::report() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return report_;
}

}  // namespace alidade
