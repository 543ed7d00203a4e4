// Latency of the real-time step with and without a calibration computing beside it, in one run, on the same
// frames: 1280x720, OE mode, at the camera's 30 frames/s, threads scheduled as by `alidade run`.
//
//   computing  taken up by the real-time thread -> record ready
//   pushed     handed over by the capture thread -> record ready: with waking up, which is the scheduler's
//
// SelfCalibration collects 12 s of the same camera first, followed by StartUpTracker. Then, in turns: its whole
// work (adjustment, check, map) in the thread of lowest priority, and as many frames without it. Other load of the
// machine so meets both. At the end the real-time thread adopts what was published, a few times. Page faults and
// heap uses are the real-time thread's. What other programs took of the processors meanwhile is reported, and what was
// left for the work at the lowest priority: where that is little, the ratio says little.
// Usage: step_latency_table [FILE.json [normal]]; normal: neither SCHED_FIFO nor locked memory.

#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "edge_app/pipeline/realtime_stage.h"
#include "platform/system/clock.h"
#include "platform/system/realtime.h"
#include "test/benchmark/calibration_load.h"
#include "test/benchmark/latency_report.h"
#include "test/benchmark/turning_camera.h"
#include "test/support/allocation_guard.h"

namespace alidade::benchmarks {
namespace {

constexpr int kHeight = 720;
constexpr int kImages = 75;             // a round of the camera
constexpr int kWarmUp = 90;             // frames until the map is full
constexpr std::size_t kCounted = 1000;  // frames, at least, of each condition
constexpr double kLongest = 150;        // s, of counting
constexpr int kAdoptions = 5;
constexpr int kAfterAdoption = 15;  // frames
constexpr int kPriority = 60;

struct FrameTiming {
  double computing_s;
  double pushed_s;
  bool oe;
};

// So far: of the real-time thread, and what other programs, and other virtual machines, took of all processors.
struct Uses {
  ThreadUse thread;
  double time_s = 0;
  double others_s = 0;
};

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

// s, of all processors, but for this process.
double others_cpu_s() {
  std::ifstream file("/proc/stat");
  std::string name;
  double user = 0, nice = 0, system = 0, idle = 0, wait = 0, interrupt = 0, soft = 0, steal = 0;
  file >> name >> user >> nice >> system >> idle >> wait >> interrupt >> soft >> steal;
  rusage own{};
  getrusage(RUSAGE_SELF, &own);
  return (user + nice + system + interrupt + soft + steal) /
             static_cast<double>(sysconf(_SC_CLK_TCK)) -
         seconds(own.ru_utime) - seconds(own.ru_stime);
}

struct Condition {
  std::vector<FrameTiming> frames;
  Uses uses;
};

// The real-time thread with its queues, driven at the camera's pace by the thread that calls.
class LiveStage {
 public:
  LiveStage(const TurningCamera& camera, const RealtimeOptions& options)
      : stage_(std::make_unique<RealtimeStage>(step_options(camera, true), true, true)),
        streams_(camera, monotonic_now_s() + 1),
        thread_([this, options] { run(options); }) {}
  ~LiveStage() {
    stage_->end_input();
    thread_.join();
  }
  LiveStage(const LiveStage&) = delete;
  LiveStage& operator=(const LiveStage&) = delete;

  // Waits for the next frame's time, for its record, and for the upkeep of the map behind it.
  FrameTiming next_frame() {
    const double due_s = streams_.time_s(frame_);
    timespec due{static_cast<time_t>(due_s), 0};
    due.tv_nsec = static_cast<long>(1e9 * (due_s - static_cast<double>(due.tv_sec)));
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &due, nullptr) != 0) {
    }
    for (int i = 0; i < kSamplesPerFrame; ++i)
      stage_->push({TelemetryMessage::Kind::kSample, streams_.sample(frame_, i)});
    VideoMessage message = streams_.frame(frame_);
    message.decoded_s = monotonic_now_s();
    stage_->push(message);
    OutputMessage out;
    while (!stage_->pop(out)) stage_->wait_output();
    while (!stage_->pop(feed_)) stage_->wait_feed();
    for (PanTiltSample sample; stage_->pop(sample);) {
    }
    ++frame_;
    return {out.made_s - out.taken_s, out.made_s - out.decoded_s,
            out.record.mode == RecordMode::kOe};
  }

  void adopt(const PublishedCalibration* calibration) {
    stage_->publish(calibration);
    for (const PublishedCalibration* adopted = nullptr; !stage_->pop_adopted(adopted);)
      stage_->wait_feed();
  }

  // Of the real-time thread, since its start-up.
  [[nodiscard]] Uses uses() const {
    ThreadUse thread;
    for (std::size_t i = 0; i < kUses.size(); ++i) thread.*(kUses[i]) = uses_[i].load();
    return {thread, monotonic_now_s(), others_cpu_s()};
  }
  // Once a frame was answered.
  [[nodiscard]] const std::string& granted() const { return granted_; }

 private:
  void run(const RealtimeOptions& options) {
    granted_ = apply_realtime(options).line();
    const ThreadUse at_start = thread_use();
    const test::AllocationGuard guard;
    bool more = true;
    while (more) {
      stage_->wait();
      more = stage_->process();
      ThreadUse use = thread_use() - at_start;
      use.allocations = guard.count();
      for (std::size_t i = 0; i < kUses.size(); ++i) uses_[i] = (use.*(kUses[i])).value_or(0);
    }
  }

  static constexpr std::array kUses{&ThreadUse::allocations, &ThreadUse::minor_page_faults,
                                    &ThreadUse::major_page_faults, &ThreadUse::voluntary_switches,
                                    &ThreadUse::involuntary_switches};

  std::unique_ptr<RealtimeStage> stage_;
  Streams streams_;
  FeedFrame feed_;
  int frame_ = 0;
  std::string granted_;
  std::array<std::atomic<std::int64_t>, 5> uses_{};
  std::thread thread_;
};

void add(const Uses& from, const Uses& to, Uses* sum) {
  sum->thread += to.thread - from.thread;
  sum->time_s += to.time_s - from.time_s;
  sum->others_s += to.others_s - from.others_s;
}

std::vector<double> times(const Condition& condition, double FrameTiming::*part) {
  std::vector<double> out;
  for (const FrameTiming& frame : condition.frames) out.push_back(frame.*part);
  return out;
}

void add(const std::string& name, const Condition& condition, LatencyReport* report) {
  report->add(name + "/computing", times(condition, &FrameTiming::computing_s),
              condition.uses.thread);
  report->add(name + "/pushed", times(condition, &FrameTiming::pushed_s), condition.uses.thread);
  nlohmann::json& context = report->context()[name];
  context["oe_frames"] = std::count_if(condition.frames.begin(), condition.frames.end(),
                                       [](const FrameTiming& frame) { return frame.oe; });
  context["processors_taken_by_others"] = condition.uses.others_s / condition.uses.time_s;
}

// False: no frame came while the calibration computed.
bool run(const RealtimeOptions& options, LatencyReport* report) {
  const TurningCamera camera(kHeight, kImages);
  const Heard heard(camera);
  CalibrationThread calibration(heard);
  LiveStage live(camera, options);
  Condition start_up;
  const Uses at_start = live.uses();
  for (int i = 0; i < kWarmUp; ++i) start_up.frames.push_back(live.next_frame());
  add(at_start, live.uses(), &start_up.uses);

  Condition with;
  Condition without;
  const double begin_s = monotonic_now_s();
  while (with.frames.size() < kCounted && monotonic_now_s() < begin_s + kLongest) {
    const Uses before = live.uses();
    calibration.begin();
    while (!calibration.done()) {
      const FrameTiming timing = live.next_frame();
      if (!calibration.done()) with.frames.push_back(timing);
      if (monotonic_now_s() > begin_s + kLongest) calibration.cancel();
    }
    const Uses between = live.uses();
    add(before, between, &with.uses);
    while (without.frames.size() < with.frames.size()) without.frames.push_back(live.next_frame());
    add(between, live.uses(), &without.uses);
  }
  for (const CalibrationMessage& message : calibration.messages())
    std::printf("%s\n", message.text.c_str());
  if (with.frames.empty()) return false;

  Condition adopting;
  const Uses before = live.uses();
  for (int i = 0; calibration.published() != nullptr && i < kAdoptions; ++i) {
    live.adopt(calibration.published().get());
    for (int k = 0; k < kAfterAdoption; ++k) adopting.frames.push_back(live.next_frame());
  }
  add(before, live.uses(), &adopting.uses);

  std::printf(
      "real-time thread: %s\n"
      "%d works of the calibration thread, %d publications, %.2f s each, %.0f %% of a "
      "processor\n\n",
      live.granted().c_str(), calibration.works(), calibration.publications(),
      calibration.wall_s() / std::max(1, calibration.works()), 100 * calibration.cpu_share());
  add("start-up", start_up, report);
  add("without calibration", without, report);
  add("with calibration", with, report);
  if (!adopting.frames.empty()) add("adopting", adopting, report);
  nlohmann::json& context = report->context();
  context["width"] = camera.calibration().camera.width;
  context["height"] = kHeight;
  context["scheduling"] = live.granted();
  context["calibration"]["works"] = calibration.works();
  context["calibration"]["publications"] = calibration.publications();
  context["calibration"]["cpu_share"] = calibration.cpu_share();
  report->print();
  std::printf(
      "processors taken by others: %.2f without calibration, %.2f with it; %d of %d frames in OE "
      "mode\n",
      context["without calibration"]["processors_taken_by_others"].get<double>(),
      context["with calibration"]["processors_taken_by_others"].get<double>(),
      context["without calibration"]["oe_frames"].get<int>() +
          context["with calibration"]["oe_frames"].get<int>(),
      static_cast<int>(with.frames.size() + without.frames.size()));
  for (const char* part : {"computing", "pushed"}) {
    const auto p99 = [report, part](const char* condition) {
      return report->json()["rows"][std::string(condition) + "/" + part]["p99_s"].get<double>();
    };
    context["p99_ratio"][part] = p99("with calibration") / p99("without calibration");
    std::printf("p99 with / without, %s: %.2f\n", part, context["p99_ratio"][part].get<double>());
  }
  return true;
}

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  const bool normal = argc > 2 && std::string(argv[2]) == "normal";
  alidade::RealtimeOptions options;
  options.priority = normal ? 0 : alidade::benchmarks::kPriority;
  options.lock_memory = !normal;
  alidade::benchmarks::LatencyReport report(normal ? "step_latency_normal"
                                                   : "step_latency_realtime");
  if (!alidade::benchmarks::run(options, &report)) {
    std::fprintf(stderr, "no frame came while the calibration computed\n");
    return 1;
  }
  return argc < 2 || report.write(argv[1]) ? 0 : 1;
}
