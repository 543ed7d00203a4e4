#pragma once
// BuiltInDetectors: runs on the pictures of a DetectorTap, in this order, the detectors of
// core/detection that are configured: onnx, the user's network (network_detector.h), people
// (person_detector.h) and motion (motion_detector.h). All boxes of a frame go to the TargetFeed
// together, as if a client had sent them. If no detector could judge the picture, nothing is sent.
// Scores become 0 to 1, but are no probabilities. The score of motion is its share of the largest
// possible score. The score of a person is 1 / (1 + e^-s), s the distance from the SVM's plane. A
// box whose middle lies in a box of an earlier detector is taken for the same thing and left out,
// and so are the last boxes beyond tracking.max_detections. Memory is taken with the first picture;
// all others must have its size. For the detector thread, except for report().

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>

#include "core/detection/motion_detector.h"
#include "core/detection/network_detector.h"
#include "core/detection/person_detector.h"
#include "edge_app/taps/detector_tap.h"
#include "edge_app/tracking/detector_kinds.h"
#include "edge_app/tracking/target_feed.h"

namespace alidade {

struct NetworkFiles {
  std::string model;       // path
  std::string labels;      // path; empty: no labels
  NetworkOptions options;  // without the labels, which come from the file
};

struct BuiltInDetectorOptions {
  // Without width and height, which come from the first picture. Empty: off.
  std::optional<MotionOptions> motion;
  std::optional<PersonOptions> people;  // needs a plane; empty: off
  std::optional<NetworkFiles> onnx;     // empty: off

  [[nodiscard]] bool has(DetectorKind kind) const;
  [[nodiscard]] bool any() const;
};

struct DetectorCounters {
  std::int64_t pictures = 0;  // looked at
  std::int64_t unjudged = 0;  // of these, not judged
  std::int64_t boxes = 0;     // found, also those that were left out
};

struct DetectorsReport {
  std::int64_t replaced = 0;  // pictures replaced by newer ones before they were looked at
  OfDetectors<std::optional<DetectorCounters>> counters;  // empty: off
};

class BuiltInDetectors : public FrameDetector {
 public:
  // options: valid. plane: may be null without people. network: for options.onnx, else null.
  // Borrows the feed: it must outlive this object.
  BuiltInDetectors(const BuiltInDetectorOptions& options,
                   std::shared_ptr<const PlaneEstimate> plane,
                   std::unique_ptr<NetworkDetector> network, TargetFeed& feed);

  void look(const DetectableFrame& frame) override;

  // Detector thread: the boxes that were sent for the last picture.
  [[nodiscard]] const std::vector<DetectionBox>& boxes() const { return boxes_; }
  // Any thread.
  [[nodiscard]] DetectorsReport report() const;

 private:
  // False: the picture could not be judged.
  [[nodiscard]] bool find(DetectorKind kind, const ImageView& image,
                          const FrameOrientation& orientation);
  [[nodiscard]] bool find_by_network(const ImageView& image);
  [[nodiscard]] bool find_people(const ImageView& image, const FrameOrientation& orientation);
  [[nodiscard]] bool find_motion(const ImageView& image, const FrameOrientation& orientation);
  // Adds the boxes whose middle lies in no box found before, each after finish(&box).
  template <typename Finish>
  void take(const std::vector<DetectionBox>& found, Finish&& finish);
  void count(DetectorKind kind, bool judged, std::size_t boxes);

  const BuiltInDetectorOptions options_;
  const std::shared_ptr<const PlaneEstimate> plane_;
  TargetFeed& feed_;
  std::unique_ptr<MotionDetector> motion_;
  std::unique_ptr<PersonDetector> people_;
  std::unique_ptr<NetworkDetector> network_;
  std::vector<DetectionBox> boxes_;  // of the present picture
  mutable std::mutex mutex_;         // guards what follows
  DetectorsReport report_;
};

}  // namespace alidade
