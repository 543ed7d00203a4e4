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

bool BuiltInDetectorOptions::has(DetectorKind kind) const {
  switch (kind) {
    case DetectorKind::kOnnx:
      return onnx.has_value();
    case DetectorKind::kPeople:
      return people.has_value();
    case DetectorKind::kMotion:
      return motion.has_value();
    case DetectorKind::kCount:
      break;
  }
  return false;
}

bool BuiltInDetectorOptions::any() const {
  return std::any_of(kDetectorKinds.begin(), kDetectorKinds.end(),
                     [this](const DetectorKindRow& row) { return has(row.kind); });
}

BuiltInDetectors::BuiltInDetectors(const BuiltInDetectorOptions& options,
                                   std::shared_ptr<const PlaneEstimate> plane,
                                   std::unique_ptr<NetworkDetector> network, TargetFeed& feed)
    : options_(options), plane_(std::move(plane)), feed_(feed), network_(std::move(network)) {
  if (options_.people) people_ = std::make_unique<PersonDetector>(*options_.people);
  for (const DetectorKindRow& row : kDetectorKinds) {
    if (options_.has(row.kind)) report_.counters[row.kind].emplace();
  }
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

void BuiltInDetectors::count(DetectorKind kind, bool judged, std::size_t boxes) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::optional<DetectorCounters>& counters = report_.counters[kind];
  ++counters->pictures;
  if (!judged) ++counters->unjudged;
  counters->boxes += static_cast<std::int64_t>(boxes);
}

bool BuiltInDetectors::find(DetectorKind kind, const ImageView& image,
                            const FrameOrientation& orientation) {
  switch (kind) {
    case DetectorKind::kOnnx:
      return find_by_network(image);
    case DetectorKind::kPeople:
      return find_people(image, orientation);
    case DetectorKind::kMotion:
      return find_motion(image, orientation);
    case DetectorKind::kCount:
      break;
  }
  return false;
}

bool BuiltInDetectors::find_by_network(const ImageView& image) {
  const bool judged = network_->find(image) == NetworkStatus::kOk;
  take(network_->boxes(), [](DetectionBox*) {});
  count(DetectorKind::kOnnx, judged, network_->boxes().size());
  return judged;
}

bool BuiltInDetectors::find_people(const ImageView& image, const FrameOrientation& orientation) {
  const bool judged = people_->find(image, orientation, plane_->plane) == PersonStatus::kOk;
  take(people_->boxes(), [](DetectionBox* box) {
    box->score = 1 / (1 + std::exp(-box->score));
    box->name = "person";
  });
  count(DetectorKind::kPeople, judged, people_->boxes().size());
  return judged;
}

bool BuiltInDetectors::find_motion(const ImageView& image, const FrameOrientation& orientation) {
  if (!motion_) {
    MotionOptions options = *options_.motion;
    options.width = image.width;
    options.height = image.height;
    // The picture is too small or too large for this detector.
    if (!options.validate()) {
      count(DetectorKind::kMotion, false, 0);
      return false;
    }
    motion_ = std::make_unique<MotionDetector>(options);
  }
  const bool judged = motion_->find(image, orientation).status == MotionStatus::kOk;
  take(motion_->boxes(),
       [](DetectionBox* box) { box->score = std::min(1.0, box->score / kMostChangeScore); });
  count(DetectorKind::kMotion, judged, motion_->boxes().size());
  return judged;
}

void BuiltInDetectors::look(const DetectableFrame& frame) {
  FrameOrientation orientation;
  if (!complete_orientation(frame.record, &orientation)) return;
  boxes_.clear();
  bool judged = false;
  for (auto row = kDetectorKinds.rbegin(); row != kDetectorKinds.rend(); ++row) {
    if (options_.has(row->kind)) judged = find(row->kind, frame.image, orientation) || judged;
  }
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
