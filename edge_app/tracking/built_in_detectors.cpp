#include "edge_app/tracking/built_in_detectors.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace alidade {
namespace {

// Restores all that a detector needs of a frame; the record's geometry has only what directions
// need.
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
                                   std::shared_ptr<const PlaneEstimate> plane,
                                   std::unique_ptr<NetworkDetector> network, TargetFeed& feed)
    : options_(options), plane_(std::move(plane)), feed_(feed), network_(std::move(network)) {
  if (options_.people) people_ = std::make_unique<PersonDetector>(*options_.people);
  if (options_.motion) report_.motion.emplace();
  if (options_.people) report_.people.emplace();
  if (options_.onnx) report_.onnx.emplace();
}

template <typename Finish>
void BuiltInDetectors::take(const std::vector<DetectionBox>& found, Finish&& finish) {
  const auto before = static_cast<std::ptrdiff_t>(boxes_.size());
  for (DetectionBox box : found) {
    const Vector2<double> middle = box.middle();
    const bool is_known =
        std::any_of(boxes_.begin(), boxes_.begin() + before, [&middle](const DetectionBox& other) {
          return middle.x() >= other.u && middle.x() <= other.u + other.width &&
                 middle.y() >= other.v && middle.y() <= other.v + other.height;
        });
    if (is_known) continue;
    finish(&box);
    boxes_.push_back(std::move(box));
  }
}

void BuiltInDetectors::count(std::optional<DetectorCounters>* counters, bool judged,
                             std::size_t boxes) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++(*counters)->pictures;
  if (!judged) ++(*counters)->unjudged;
  (*counters)->boxes += static_cast<std::int64_t>(boxes);
}

bool BuiltInDetectors::find_by_network(const ImageView& image) {
  const bool judged = network_->find(image) == NetworkStatus::kOk;
  take(network_->boxes(), [](DetectionBox*) {});
  count(&report_.onnx, judged, network_->boxes().size());
  return judged;
}

bool BuiltInDetectors::find_people(const ImageView& image, const FrameOrientation& orientation) {
  const bool judged = people_->find(image, orientation, plane_->plane) == PersonStatus::kOk;
  take(people_->boxes(), [](DetectionBox* box) {
    box->score = 1 / (1 + std::exp(-box->score));
    box->name = "person";
  });
  count(&report_.people, judged, people_->boxes().size());
  return judged;
}

bool BuiltInDetectors::find_motion(const ImageView& image, const FrameOrientation& orientation) {
  if (!motion_) {
    MotionOptions options = *options_.motion;
    options.width = image.width;
    options.height = image.height;
    // The picture is too small or too large for this detector.
    if (!options.validate()) {
      count(&report_.motion, false, 0);
      return false;
    }
    motion_ = std::make_unique<MotionDetector>(options);
  }
  const bool judged = motion_->find(image, orientation).status == MotionStatus::kOk;
  take(motion_->boxes(),
       [](DetectionBox* box) { box->score = std::min(1.0, box->score / kMostChangeScore); });
  count(&report_.motion, judged, motion_->boxes().size());
  return judged;
}

void BuiltInDetectors::look(const DetectableFrame& frame) {
  FrameOrientation orientation;
  if (!complete_orientation(frame.record, &orientation)) return;
  boxes_.clear();
  bool judged = false;
  if (network_) judged = find_by_network(frame.image);
  if (people_) judged = find_people(frame.image, orientation) || judged;
  if (options_.motion) judged = find_motion(frame.image, orientation) || judged;
  if (!judged) return;
  const auto most = static_cast<std::size_t>(feed_.options().tracker.max_detections);
  if (boxes_.size() > most) boxes_.resize(most);
  // The feed counts the outcome.
  static_cast<void>(feed_.offer({frame.record, boxes_}));
}

DetectorsReport BuiltInDetectors::report() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return report_;
}

}  // namespace alidade
