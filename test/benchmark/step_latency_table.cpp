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

#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "edge_app/pipeline/realtime_stage.h"
#include "edge_app/pipeline/self_calibration.h"
#include "platform/system/clock.h"
#include "platform/system/realtime.h"
#include "test/benchmark/turning_camera.h"
#include "test/support/allocation_guard.h"

namespace alidade::benchmarks {
namespace {

constexpr int kHeight = 720;
constexpr int kPictures = 75;          // a round of the camera
constexpr int kCollected = 360;        // frames that the calibration is made of
constexpr int kWarmUp = 90;            // frames until the map is full
constexpr std::size_t kCounted = 600;  // frames, at least, of each condition
constexpr double kLongest = 150;       // s, of counting
constexpr int kAdoptions = 5;
constexpr int kAfterAdoption = 15;  // frames
constexpr int kSamplesPerFrame = 2;
constexpr double kAngleSigma = 1e-5;  // rad
constexpr int kPriority = 60;

struct FrameTiming {
  double computing_s;
  double pushed_s;
  bool oe;
};

// So far: of the real-time thread, and what other programs, and other virtual machines, took of all processors.
struct Uses {
  long page_faults = 0;
  std::int64_t heap = 0;
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

// The streams of a camera that began to turn at start_s. Frames are stamped with their row 0, and known
// then: the constant delay of a real link is the clock offset's affair.
class Streams {
 public:
  Streams(const TurningCamera& camera, double start_s) : camera_(camera), start_s_(start_s) {}

  [[nodiscard]] double time_s(int k) const { return start_s_ + camera_.time_s(k); }
  [[nodiscard]] VideoMessage frame(int k) const {
    VideoMessage message;
    message.stamp.frame = k;
    message.stamp.sequence = k;
    message.stamp.receive_time_s = time_s(k);
    message.picture = camera_.view(k);
    return message;
  }
  // The i-th of the samples just before frame k.
  PanTiltSample sample(int k, int i) {
    const int sequence = kSamplesPerFrame * k + i;
    const double time = camera_.time_s(k - 1) + (i + 1) * (camera_.time_s(1) / kSamplesPerFrame);
    const PanTilt<double> angle = camera_.angle(time);
    PanTiltSample sample;
    sample.sequence = sequence;
    sample.earliest_time_s = sample.latest_time_s = start_s_ + time;
    sample.pan_rad = angle.pan + noise_(random_);
    sample.tilt_rad = angle.tilt + noise_(random_);
    return sample;
  }

 private:
  const TurningCamera& camera_;
  double start_s_;
  std::mt19937 random_{1};
  std::normal_distribution<double> noise_{0, kAngleSigma};
};

OrientationStepOptions step_options(const TurningCamera& camera, bool calibrated) {
  OrientationStepOptions options;
  options.calibration = camera.calibration();
  options.calibrated = calibrated;
  options.telemetry_noise.pan_tilt_sigma = kAngleSigma;
  options.oe = oe_options(camera.calibration().camera);
  options.follow_points = true;
  return options;
}

// What the calibration thread heard of the first frames, to be told again and again.
class Heard {
 public:
  explicit Heard(const TurningCamera& camera) : camera_(camera) {
    OrientationStep step(step_options(camera, false));
    Streams streams(camera, 0);
    StepEvents events;
    for (int k = 0; k < kCollected; ++k) {
      for (int i = 0; i < kSamplesPerFrame; ++i) {
        samples_.push_back(streams.sample(k, i));
        step.add_telemetry(samples_.back());
      }
      const VideoMessage message = streams.frame(k);
      static_cast<void>(step.add_frame(message.stamp, message.picture, &events));
      step.maintain();
      tracks_.emplace_back();
      step.get_tracks(&tracks_.back());
    }
  }

  [[nodiscard]] std::unique_ptr<SelfCalibration> told() const {
    SelfCalibrationOptions options;
    options.data_sheet = camera_.calibration();
    options.data_sheet.camera.focal_length *= 1.1;
    options.data_sheet.line_delay = 0;
    options.noise.pan_tilt_sigma_rad = kAngleSigma;
    auto calibration = std::make_unique<SelfCalibration>(options, nullptr);
    for (int k = 0; k < kCollected; ++k) {
      for (int i = 0; i < kSamplesPerFrame; ++i)
        calibration->add(samples_[static_cast<std::size_t>(kSamplesPerFrame * k + i)]);
      calibration->add(tracks_[static_cast<std::size_t>(k)]);
      if (calibration->wants_keyframe()) calibration->add_keyframe(camera_.view(k));
    }
    return calibration;
  }

 private:
  const TurningCamera& camera_;
  std::vector<PanTiltSample> samples_;
  std::vector<FrameTracks> tracks_;
};

double thread_cpu_s() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// The calibration thread: does one work when asked.
class CalibrationThread {
 public:
  explicit CalibrationThread(const Heard& heard)
      : heard_(heard), thread_(&CalibrationThread::run, this) {}
  ~CalibrationThread() {
    end_ = true;
    asked_.post();
    thread_.join();
  }
  CalibrationThread(const CalibrationThread&) = delete;
  CalibrationThread& operator=(const CalibrationThread&) = delete;

  void begin() {
    calibration_ = heard_.told();
    done_ = false;
    asked_.post();
  }
  // At normal priority, as it may be starved.
  void cancel() {
    calibration_->cancel();
    const sched_param none{};
    pthread_setschedparam(thread_.native_handle(), SCHED_OTHER, &none);
  }
  [[nodiscard]] bool done() const { return done_; }

  // While done().
  [[nodiscard]] const std::shared_ptr<const PublishedCalibration>& published() const {
    return published_;
  }
  [[nodiscard]] int works() const { return works_; }
  [[nodiscard]] int publications() const { return publications_; }
  [[nodiscard]] double cpu_share() const { return wall_s_ > 0 ? cpu_s_ / wall_s_ : 0; }
  [[nodiscard]] double wall_s() const { return wall_s_; }
  [[nodiscard]] std::vector<std::string> messages() { return calibration_->take_messages(); }

 private:
  void run() {
    const std::string warning = set_lowest_priority();
    if (!warning.empty()) std::fprintf(stderr, "calibration thread: %s\n", warning.c_str());
    for (asked_.wait(); !end_; asked_.wait()) {
      const double begin_s = monotonic_now_s();
      const double cpu_begin_s = thread_cpu_s();
      if (auto published = calibration_->work()) {
        published_ = std::move(published);
        ++publications_;
      }
      ++works_;
      wall_s_ += monotonic_now_s() - begin_s;
      cpu_s_ += thread_cpu_s() - cpu_begin_s;
      done_ = true;
    }
  }

  const Heard& heard_;
  std::unique_ptr<SelfCalibration> calibration_;
  std::shared_ptr<const PublishedCalibration> published_;
  int works_ = 0;
  int publications_ = 0;
  double wall_s_ = 0;
  double cpu_s_ = 0;
  std::atomic<bool> done_{true};
  std::atomic<bool> end_{false};
  Semaphore asked_;
  std::thread thread_;
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
    return {page_faults_, heap_uses_, monotonic_now_s(), others_cpu_s()};
  }
  // Once a frame was answered.
  [[nodiscard]] const std::string& granted() const { return granted_; }

 private:
  void run(const RealtimeOptions& options) {
    granted_ = apply_realtime(options).line();
    const long at_start = page_faults();
    const test::AllocationGuard guard;
    bool more = true;
    while (more) {
      stage_->wait();
      more = stage_->process();
      page_faults_ = page_faults() - at_start;
      heap_uses_ = guard.count();
    }
  }

  static long page_faults() {
    const PageFaults faults = thread_page_faults();
    return faults.minor + faults.major;
  }

  std::unique_ptr<RealtimeStage> stage_;
  Streams streams_;
  FeedFrame feed_;
  int frame_ = 0;
  std::string granted_;
  std::atomic<long> page_faults_{0};
  std::atomic<std::int64_t> heap_uses_{0};
  std::thread thread_;
};

void add(const Uses& from, const Uses& to, Uses* sum) {
  sum->page_faults += to.page_faults - from.page_faults;
  sum->heap += to.heap - from.heap;
  sum->time_s += to.time_s - from.time_s;
  sum->others_s += to.others_s - from.others_s;
}

double quantile_ms(const Condition& condition, double FrameTiming::*part, double q) {
  std::vector<double> values;
  for (const FrameTiming& frame : condition.frames) values.push_back(1e3 * (frame.*part));
  std::sort(values.begin(), values.end());
  const double place = q * static_cast<double>(values.size() - 1);
  return values[static_cast<std::size_t>(std::lround(place))];
}

nlohmann::json report(const char* name, const Condition& condition) {
  const auto of = [&](double FrameTiming::*part) {
    nlohmann::json quantiles;
    quantiles["p50_ms"] = quantile_ms(condition, part, 0.5);
    quantiles["p99_ms"] = quantile_ms(condition, part, 0.99);
    quantiles["max_ms"] = quantile_ms(condition, part, 1);
    return quantiles;
  };
  nlohmann::json row;
  row["frames"] = condition.frames.size();
  row["oe_frames"] = std::count_if(condition.frames.begin(), condition.frames.end(),
                                   [](const FrameTiming& frame) { return frame.oe; });
  row["computing"] = of(&FrameTiming::computing_s);
  row["pushed"] = of(&FrameTiming::pushed_s);
  row["others_load"] = condition.uses.others_s / condition.uses.time_s;
  row["page_faults"] = condition.uses.page_faults;
  row["heap_uses"] = condition.uses.heap;
  std::printf("| %s | %zu | %zu |", name, condition.frames.size(),
              row["oe_frames"].get<std::size_t>());
  for (const char* part : {"computing", "pushed"}) {
    for (const char* quantile : {"p50_ms", "p99_ms", "max_ms"})
      std::printf(" %.3f |", row[part][quantile].get<double>());
  }
  std::printf(" %.2f | %ld | %ld |\n", row["others_load"].get<double>(), condition.uses.page_faults,
              static_cast<long>(condition.uses.heap));
  return row;
}

nlohmann::json run(const RealtimeOptions& options) {
  const TurningCamera camera(kHeight, kPictures);
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
  for (const std::string& line : calibration.messages()) std::printf("%s\n", line.c_str());
  if (with.frames.empty()) return {};

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
  std::printf(
      "| frames | count | in OE mode | computing p50 ms | p99 | max | from pushed p50 ms | p99 "
      "| max | processors taken by others | page faults | heap uses |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  nlohmann::json out;
  out["width"] = camera.calibration().camera.width;
  out["height"] = kHeight;
  out["scheduling"] = live.granted();
  out["start_up"] = report("start-up", start_up);
  out["without"] = report("without calibration", without);
  out["with"] = report("with calibration", with);
  if (!adopting.frames.empty()) out["adopting"] = report("adopting", adopting);
  out["calibration"]["works"] = calibration.works();
  out["calibration"]["publications"] = calibration.publications();
  out["calibration"]["cpu_share"] = calibration.cpu_share();
  for (const char* part : {"computing", "pushed"}) {
    const double ratio =
        out["with"][part]["p99_ms"].get<double>() / out["without"][part]["p99_ms"].get<double>();
    out["p99_ratio"][part] = ratio;
    std::printf("p99 with / without, %s: %.2f\n", part, ratio);
  }
  return out;
}

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  const bool normal = argc > 2 && std::string(argv[2]) == "normal";
  alidade::RealtimeOptions options;
  options.priority = normal ? 0 : alidade::benchmarks::kPriority;
  options.lock_memory = !normal;
  const nlohmann::json report = alidade::benchmarks::run(options);
  if (report.is_null()) {
    std::fprintf(stderr, "no frame came while the calibration computed\n");
    return 1;
  }
  if (argc > 1) {
    std::ofstream file(argv[1]);
    file << report.dump(2) << '\n';
    if (!file) {
      std::fprintf(stderr, "cannot write %s\n", argv[1]);
      return 1;
    }
  }
  return 0;
}
