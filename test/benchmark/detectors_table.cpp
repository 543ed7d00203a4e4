// Detection and tracking beside the real-time step (paired_turns.h): the built-in detectors for motion and for people, who never come to an end of a
// picture before the next is there, their boxes tracked on the ground; and a tracker that has 200 targets in the sky to follow.
// Usage: detectors_table [FILE.json [normal]]

#include <memory>
#include <optional>
#include <utility>

#include "edge_app/taps/detector_tap.h"
#include "edge_app/tracking/built_in_detectors.h"
#include "edge_app/tracking/target_feed.h"
#include "test/benchmark/latency_report.h"
#include "test/benchmark/paired_turns.h"
#include "test/benchmark/sent_pictures.h"
#include "test/benchmark/watched_ground.h"

namespace alidade::benchmarks {
namespace {

constexpr int kColumns = 20, kRows = 10;  // of targets in the sky

BuiltInDetectorOptions all_but_a_network() {
  BuiltInDetectorOptions out;
  out.motion.emplace();
  out.people.emplace();
  return out;
}

// The detectors, and whoever else finds things in the same pictures: boxes that stand in the sky.
class Load final : public FrameDetector, public Beside {
 public:
  Load() { require(found_.start() && crowd_.start(), "the thread for targets cannot be started"); }
  void look(const DetectableFrame& frame) override {
    detectors_.look(frame);
    DetectedFrame crowd{frame.record, {}};
    add_standing_boxes(kColumns, kRows, &crowd);
    boxes_ += static_cast<std::int64_t>(crowd.boxes.size());
    ++pictures_;
    static_cast<void>(crowd_.offer(std::move(crowd)));
  }
  void join(PipelineOptions* options) override { options->detectors = &tap_.emplace(*this); }
  [[nodiscard]] nlohmann::json stop() override {
    found_.stop();
    crowd_.stop();
    const DetectorsReport report = detectors_.report();
    const DetectorCounters& motion = *report.counters[DetectorKind::kMotion];
    const DetectorCounters& people = *report.counters[DetectorKind::kPeople];
    const auto newest = crowd_.snapshot().newest;
    return {{"pictures", pictures_},
            {"motion_judged", motion.pictures - motion.unjudged},
            {"people_judged", people.pictures - people.unjudged},
            {"boxes_a_picture", static_cast<double>(boxes_) / static_cast<double>(pictures_)},
            {"targets", newest ? newest->targets.size() : 0},
            {"tracked_frames", crowd_.snapshot().counters.of(DetectionStatus::kTaken)}};
  }

 private:
  const std::shared_ptr<const PlaneEstimate> ground_ = watched_ground();
  TargetFeed found_{default_target_options(TargetSpace::kPlane), ground_};
  TargetFeed crowd_{default_target_options(TargetSpace::kSphere), nullptr};
  BuiltInDetectors detectors_{all_but_a_network(), ground_, nullptr, found_};
  std::int64_t boxes_ = 0;
  std::int64_t pictures_ = 0;
  std::optional<DetectorTap> tap_;
};

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  using namespace alidade::benchmarks;
  return compare_turns(argc, argv, "detectors", "detection and tracking",
                       [](const TurningCamera&) { return std::make_unique<Load>(); });
}
