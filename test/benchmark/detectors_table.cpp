// Latency of the real-time stage of `alidade run` with and without detection and tracking beside it, in one run: the whole Pipeline with its
// threads, 1280x720 at 30 frames/s in OE mode. Beside it: the built-in detectors for motion and for people, who never come to an end of a picture
// before the next is there, their boxes tracked on the ground; and a tracker that has 200 targets in the sky to follow.
//
// A frame counts from when the capture thread has it to its record: waiting, waking up and computing. A turn is a pipeline from its beginning to its
// end; turns of both conditions alternate, so that other load of the machine meets both. The ratio of the 99 % quantiles is given with the interval
// that chance leaves in 95 % of cases, from pairs of turns drawn again; it fails if even its lower end is above 1.2.
// Usage: detectors_table [FILE.json [normal]]; normal: neither SCHED_FIFO nor locked memory.

#include <algorithm>
#include <cstdio>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "edge_app/pipeline/pipeline.h"
#include "edge_app/tracking/built_in_detectors.h"
#include "edge_app/tracking/target_feed.h"
#include "test/benchmark/calibration_load.h"
#include "test/benchmark/latency_report.h"
#include "test/benchmark/paced_sources.h"
#include "test/benchmark/sent_pictures.h"
#include "test/benchmark/turning_camera.h"
#include "test/benchmark/watched_ground.h"

namespace alidade::benchmarks {
namespace {

constexpr int kHeight = 720;
constexpr int kImages = 75;
constexpr std::size_t kWarmUp = 90;  // frames
constexpr std::size_t kTurn = 210;   // frames
constexpr std::size_t kPairs = 12;   // of turns
constexpr std::size_t kDraws = 1000;
constexpr int kPriority = 60;
constexpr double kAllowed = 1.2;          // ratio of the quantiles; chance may not explain more
constexpr int kColumns = 20, kRows = 10;  // of targets in the sky

BuiltInDetectorOptions all_but_a_network() {
  BuiltInDetectorOptions out;
  out.motion.emplace();
  out.people.emplace();
  return out;
}

// The detectors, and whoever else finds things in the same pictures: boxes that stand in the sky.
class Load final : public FrameDetector {
 public:
  Load() { require(found_.start() && crowd_.start(), "there can be no thread for targets"); }
  void look(const DetectableFrame& frame) override {
    detectors_.look(frame);
    DetectedFrame crowd{frame.record, {}};
    add_standing_boxes(kColumns, kRows, &crowd);
    boxes_ += static_cast<std::int64_t>(crowd.boxes.size());
    ++pictures_;
    static_cast<void>(crowd_.offer(std::move(crowd)));
  }
  void stop() {
    found_.stop();
    crowd_.stop();
  }
  [[nodiscard]] nlohmann::json told() const {
    const DetectorsReport report = detectors_.report();
    const auto newest = crowd_.snapshot().newest;
    return {{"pictures", pictures_},
            {"motion_judged", report.motion->pictures - report.motion->unjudged},
            {"people_judged", report.people->pictures - report.people->unjudged},
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
};

// Latencies, while somebody wants them.
class Recorder final : public RecordSink {
 public:
  bool write(const OrientationRecord& record) override {
    const std::lock_guard<PriorityMutex> lock(mutex_);
    if (!record.frame || !record.latency_s) return true;
    ++frames_;
    if (frames_ <= kWarmUp || taken_s_.size() == kTurn) return true;
    taken_s_.push_back(*record.latency_s);
    oe_ += record.mode == RecordMode::kOe ? 1 : 0;
    return true;
  }
  void interrupt() override {}
  [[nodiscard]] std::string error() const override { return ""; }

  [[nodiscard]] bool is_full() const {
    const std::lock_guard<PriorityMutex> lock(mutex_);
    return taken_s_.size() == kTurn;
  }
  [[nodiscard]] bool is_warm() const {
    const std::lock_guard<PriorityMutex> lock(mutex_);
    return frames_ >= kWarmUp;
  }
  [[nodiscard]] const std::vector<double>& taken_s() const { return taken_s_; }
  [[nodiscard]] int oe() const { return oe_; }

 private:
  mutable PriorityMutex mutex_;
  std::vector<double> taken_s_;
  std::size_t frames_ = 0;
  int oe_ = 0;
};

struct Condition {
  std::vector<std::vector<double>> turns;
  ThreadUse use;
  std::int64_t oe = 0;
  std::int64_t dropped = 0;
};

void take_turn(const TurningCamera& camera, const RealtimeOptions& realtime, Load* load,
               Condition* condition) {
  const double start_s = monotonic_now_s() + 0.1;
  PacedVideo video(camera, start_s, 1, true);
  PacedPanTilt pan_tilt(camera, start_s, 1);
  PipelineOptions options;
  options.step = step_options(camera, true);
  options.step.follow_points = false;
  options.realtime = realtime;
  std::optional<DetectorTap> tap;
  if (load != nullptr) options.detectors = &tap.emplace(*load);
  Recorder recorder;
  Pipeline pipeline(video, pan_tilt, recorder, nullptr, options);
  pipeline.start();
  while (!recorder.is_warm()) sleep_until(monotonic_now_s() + kLook);
  const int realtime_thread = fifo_thread(kPriority);
  const ThreadUse before = use_of(realtime_thread);
  while (!recorder.is_full()) sleep_until(monotonic_now_s() + kLook);
  condition->use += use_of(realtime_thread) - before;
  pipeline.stop();
  require(pipeline.error().empty(), pipeline.error().c_str());
  condition->turns.push_back(recorder.taken_s());
  condition->oe += recorder.oe();
  condition->dropped += pipeline.summary().drops.total();
}

std::vector<double> all_of(const std::vector<std::vector<double>>& turns) {
  std::vector<double> all;
  for (const auto& turn : turns) all.insert(all.end(), turn.begin(), turn.end());
  return all;
}

double p99_ratio(const std::vector<std::vector<double>>& with,
                 const std::vector<std::vector<double>>& without) {
  return quantile(all_of(with), 0.99) / quantile(all_of(without), 0.99);
}

// Neighbours in time stay together: they met the same other load.
std::vector<double> drawn_ratios(const Condition& with, const Condition& without) {
  std::mt19937 random(1);
  std::uniform_int_distribution<std::size_t> any(0, kPairs - 1);
  std::vector<double> drawn;
  for (std::size_t i = 0; i < kDraws; ++i) {
    std::vector<std::vector<double>> with_again;
    std::vector<std::vector<double>> without_again;
    for (std::size_t turn = 0; turn < kPairs; ++turn) {
      const std::size_t pair = any(random);
      with_again.push_back(with.turns[pair]);
      without_again.push_back(without.turns[pair]);
    }
    drawn.push_back(p99_ratio(with_again, without_again));
  }
  return drawn;
}

bool run(const RealtimeOptions& realtime, LatencyReport* report) {
  // Threads that OpenCV starts have the priority of the one that first needs them: the detector's, as in `alidade run`.
  cv::setNumThreads(1);
  const TurningCamera camera(kHeight, kImages);
  cv::setNumThreads(-1);
  Condition with;
  Condition without;
  nlohmann::json load_told;
  for (std::size_t pair = 0; pair < kPairs; ++pair) {
    // The first of a pair is now the one, now the other.
    for (const bool loaded : {pair % 2 == 0, pair % 2 != 0}) {
      if (!loaded) {
        take_turn(camera, realtime, nullptr, &without);
        continue;
      }
      Load load;
      take_turn(camera, realtime, &load, &with);
      load.stop();
      load_told = load.told();
    }
  }
  report->add("without detection", all_of(without.turns), without.use);
  report->add("with detection and tracking", all_of(with.turns), with.use);
  const std::vector<double> drawn = drawn_ratios(with, without);
  nlohmann::json& out = report->context();
  out["oe_frames"] = with.oe + without.oe;
  out["dropped"] = with.dropped + without.dropped;
  out["load"] = load_told;
  out["p99_ratio"] = p99_ratio(with.turns, without.turns);
  out["p99_ratio_95_percent"] = {quantile(drawn, 0.025), quantile(drawn, 0.975)};
  out["p99_ratio_allowed"] = kAllowed;
  report->print();
  std::printf("a turn's load: %s\n", load_told.dump().c_str());
  std::printf(
      "p99 with / without: %.3f (95 %%: %.3f to %.3f); %d of %d frames in OE mode; dropped %d\n",
      p99_ratio(with.turns, without.turns), quantile(drawn, 0.025), quantile(drawn, 0.975),
      static_cast<int>(with.oe + without.oe), static_cast<int>(2 * kPairs * kTurn),
      static_cast<int>(with.dropped + without.dropped));
  return quantile(drawn, 0.025) <= kAllowed;
}

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  using namespace alidade;
  const bool normal = argc > 2 && std::string(argv[2]) == "normal";
  RealtimeOptions realtime;
  realtime.priority = normal ? 0 : benchmarks::kPriority;
  realtime.lock_memory = !normal;
  benchmarks::LatencyReport report(normal ? "detectors_normal" : "detectors_realtime");
  const bool holds = benchmarks::run(realtime, &report);
  return (argc < 2 || report.write(argv[1])) && holds ? 0 : 1;
}
