#pragma once
// BuiltInDetectors: what moves (core/detection/motion_detector.h), and people (person_detector.h), in the pictures that a DetectorTap hands
// over. Both detectors' boxes of a frame go to the TargetFeed together, as if somebody had sent them; where no detector could judge the picture,
// nothing goes there, as that is no answer.
// Scores become 0 to 1: of motion, the share of the largest that there is; of a person, 1 / (1 + e^-s), s the distance from the SVM's plane. Neither
// is a probability. A mover whose middle is in a person's box is that person, and left out.
// Memory is taken with the first picture, whose size all others must have. For the detector thread, but for report().

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>

#include "core/detection/motion_detector.h"
#include "core/detection/person_detector.h"
#include "edge_app/pipeline/detector_tap.h"
#include "edge_app/tracking/target_feed.h"

namespace alidade {

struct BuiltInDetectorOptions {
  std::optional<MotionOptions>
      motion;  // but for width and height, which the first picture tells; empty: off
  std::optional<PersonOptions> people;  // takes a plane; empty: off

  [[nodiscard]] bool any() const { return motion || people; }
};

struct DetectorCounters {
  std::int64_t pictures = 0;  // that it looked at
  std::int64_t unjudged = 0;  // of these, that it could say nothing of
  std::int64_t boxes = 0;     // that it found
};

struct DetectorsReport {
  std::int64_t replaced = 0;  // pictures not looked at, as a newer one came
  std::optional<DetectorCounters> motion, people;
};

class BuiltInDetectors : public FrameDetector {
 public:
  // options are valid. plane: may be null without people. Borrows the feed.
  BuiltInDetectors(const BuiltInDetectorOptions& options,
                   std::shared_ptr<const PlaneEstimate> plane, TargetFeed& feed);

  void look(const DetectableFrame& frame) override;

  // Any thread.
  [[nodiscard]] DetectorsReport report() const;

 private:
  // False: it could not judge the picture.
  [[nodiscard]] bool find_people(const ImageView& image, const FrameOrientation& orientation);
  [[nodiscard]] bool find_motion(const ImageView& image, const FrameOrientation& orientation);
  void count(std::optional<DetectorCounters>* counters, bool judged, std::size_t boxes);

  const BuiltInDetectorOptions options_;
  const std::shared_ptr<const PlaneEstimate> plane_;
  TargetFeed& feed_;
  std::unique_ptr<MotionDetector> motion_;
  std::unique_ptr<PersonDetector> people_;
  std::vector<DetectionBox> boxes_;  // of the picture at hand
  mutable std::mutex mutex_;         // of what follows
  DetectorsReport report_;
};

}  // namespace alidade
