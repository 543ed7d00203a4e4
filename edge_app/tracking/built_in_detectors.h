#pragma once
// BuiltInDetectors: what the user's network finds (core/detection/network_detector.h), people (person_detector.h), and what moves (motion_detector.h), in
// the pictures that a DetectorTap hands over. All detectors' boxes of a frame go to the TargetFeed together, as if somebody had sent them; where no detector
// could judge the picture, nothing goes there, as that is no answer.
// Scores become 0 to 1: of motion, the share of the largest that there is; of a person, 1 / (1 + e^-s), s the distance from the SVM's plane. Neither
// is a probability. A box whose middle is in one of a detector before, in this order, is of the same thing, and left out.
// Memory is taken with the first picture, whose size all others must have. For the detector thread, but for report().

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>

#include "core/detection/motion_detector.h"
#include "core/detection/network_detector.h"
#include "core/detection/person_detector.h"
#include "edge_app/taps/detector_tap.h"
#include "edge_app/tracking/target_feed.h"

namespace alidade {

struct NetworkFiles {
  std::string model;       // path
  std::string labels;      // path; empty: none
  NetworkOptions options;  // but for the labels, which the file tells
};

struct BuiltInDetectorOptions {
  std::optional<MotionOptions>
      motion;  // but for width and height, which the first picture tells; empty: off
  std::optional<PersonOptions> people;  // takes a plane; empty: off
  std::optional<NetworkFiles> onnx;     // empty: off

  [[nodiscard]] bool any() const { return motion || people || onnx; }
};

struct DetectorCounters {
  std::int64_t pictures = 0;  // that it looked at
  std::int64_t unjudged = 0;  // of these, that it could say nothing of
  std::int64_t boxes = 0;     // that it found
};

struct DetectorsReport {
  std::int64_t replaced = 0;  // pictures not looked at, as a newer one came
  std::optional<DetectorCounters> motion, people, onnx;
};

class BuiltInDetectors : public FrameDetector {
 public:
  // options are valid. plane: may be null without people; network: that of options.onnx, null without. Borrows the feed.
  BuiltInDetectors(const BuiltInDetectorOptions& options,
                   std::shared_ptr<const PlaneEstimate> plane,
                   std::unique_ptr<NetworkDetector> network, TargetFeed& feed);

  void look(const DetectableFrame& frame) override;

  // Of the picture last looked at, what was handed over; for the thread that looks.
  [[nodiscard]] const std::vector<DetectionBox>& boxes() const { return boxes_; }
  // Any thread.
  [[nodiscard]] DetectorsReport report() const;

 private:
  // False: it could not judge the picture.
  [[nodiscard]] bool find_by_network(const ImageView& image);
  [[nodiscard]] bool find_people(const ImageView& image, const FrameOrientation& orientation);
  [[nodiscard]] bool find_motion(const ImageView& image, const FrameOrientation& orientation);
  // Those of them that are of nothing that was found before, after finish(&box).
  template <typename Finish>
  void take(const std::vector<DetectionBox>& found, Finish&& finish);
  void count(std::optional<DetectorCounters>* counters, bool judged, std::size_t boxes);

  const BuiltInDetectorOptions options_;
  const std::shared_ptr<const PlaneEstimate> plane_;
  TargetFeed& feed_;
  std::unique_ptr<MotionDetector> motion_;
  std::unique_ptr<PersonDetector> people_;
  std::unique_ptr<NetworkDetector> network_;
  std::vector<DetectionBox> boxes_;  // of the picture at hand
  mutable std::mutex mutex_;         // of what follows
  DetectorsReport report_;
};

}  // namespace alidade
