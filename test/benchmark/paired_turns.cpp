#include "test/benchmark/paired_turns.h"

#include <algorithm>
#include <cstdio>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "test/benchmark/calibration_load.h"
#include "test/benchmark/paced_sources.h"
#include "test/benchmark/sent_pictures.h"

namespace alidade::benchmarks {
namespace {

constexpr int kHeight = 720;
constexpr int kImages = 75;
constexpr std::size_t kWarmUp = 90;  // frames
constexpr std::size_t kTurn = 210;   // frames
constexpr std::size_t kPairs = 12;   // of turns
constexpr std::size_t kDraws = 1000;
constexpr int kPriority = 60;
constexpr double kAllowed = 1.2;  // ratio of the quantiles; chance may not explain more

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

void take_turn(const TurningCamera& camera, const RealtimeOptions& realtime, Beside* beside,
               Condition* condition) {
  const double start_s = monotonic_now_s() + 0.1;
  PacedVideo video(camera, start_s, 1, true);
  PacedPanTilt pan_tilt(camera, start_s, 1);
  PipelineOptions options;
  options.step = step_options(camera, true);
  options.step.follow_points = false;
  options.realtime = realtime;
  if (beside != nullptr) beside->join(&options);
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

}  // namespace

int compare_turns(int argc, char** argv, const std::string& name, const std::string& what,
                  const std::function<std::unique_ptr<Beside>(const TurningCamera& camera)>& make) {
  const bool normal = argc > 2 && std::string(argv[2]) == "normal";
  RealtimeOptions realtime;
  realtime.priority = normal ? 0 : kPriority;
  realtime.lock_memory = !normal;
  // Threads that OpenCV starts have the priority of the one that first needs them: the one beside, as in `alidade run`.
  cv::setNumThreads(1);
  const TurningCamera camera(kHeight, kImages);
  cv::setNumThreads(-1);
  Condition with;
  Condition without;
  nlohmann::json load;
  for (std::size_t pair = 0; pair < kPairs; ++pair) {
    // The first of a pair is now the one, now the other.
    for (const bool loaded : {pair % 2 == 0, pair % 2 != 0}) {
      if (!loaded) {
        take_turn(camera, realtime, nullptr, &without);
        continue;
      }
      const std::unique_ptr<Beside> beside = make(camera);
      take_turn(camera, realtime, beside.get(), &with);
      load = beside->stop();
    }
  }
  LatencyReport report(name + (normal ? "_normal" : "_realtime"));
  report.add("without " + what, all_of(without.turns), without.use);
  report.add("with " + what, all_of(with.turns), with.use);
  const double ratio = p99_ratio(with.turns, without.turns);
  const std::vector<double> drawn = drawn_ratios(with, without);
  const double least = quantile(drawn, 0.025);
  const double most = quantile(drawn, 0.975);
  nlohmann::json& out = report.context();
  out["oe_frames"] = with.oe + without.oe;
  out["dropped"] = with.dropped + without.dropped;
  out["load"] = load;
  out["p99_ratio"] = ratio;
  out["p99_ratio_95_percent"] = {least, most};
  out["p99_ratio_allowed"] = kAllowed;
  report.print();
  std::printf("a turn's load: %s\n", load.dump().c_str());
  std::printf(
      "p99 with / without: %.3f (95 %%: %.3f to %.3f); %d of %d frames in OE mode; dropped %d\n",
      ratio, least, most, static_cast<int>(with.oe + without.oe),
      static_cast<int>(2 * kPairs * kTurn), static_cast<int>(with.dropped + without.dropped));
  return (argc < 2 || report.write(argv[1])) && least <= kAllowed ? 0 : 1;
}

}  // namespace alidade::benchmarks
