// Latency from a picture's arrival to its record written while as many other programs compute as there are processors: all that a
// frame passes in `alidade run`, as end_to_end_table has it, with realtime.priority and without, in turns, and the processor time
// that each takes. 1280x720 at 30 frames/s over the loopback, as RTP (from the last packet) and as MJPEG over HTTP (from the first byte).
// Besides: records by telemetry alone, whose pictures nobody decodes, from the frame's arrival, without the other programs and beside them;
// and what of that is the kernel's: two wake-ups of threads that sleep, by the same semaphores, on one processor and on any.
//
// Judged where priority is granted (a judgement that fails is said, and the exit code is 1):
//   with priority      p99 <= 2 p50 + 2 ms, and no more processor time than without by kMoreCpu
//   without            p99 <= 5 p50
//   telemetry alone    p50 <= 20 us, without other programs
// Usage: busy_machine_table [FILE.json]

#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "edge_app/pipeline/pipeline.h"
#include "platform/system/clock.h"
#include "platform/system/semaphore.h"
#include "platform/video/mjpeg_source.h"
#include "platform/video/rtp_source.h"
#include "test/benchmark/calibration_load.h"
#include "test/benchmark/latency_report.h"
#include "test/benchmark/paced_sources.h"
#include "test/benchmark/sent_pictures.h"
#include "test/benchmark/turning_camera.h"

namespace alidade::benchmarks {
namespace {

constexpr int kHeight = 720;
constexpr int kImages = 75;
constexpr std::size_t kWarmUp = 60;  // frames
constexpr std::size_t kTurn = 250;   // frames
constexpr int kTurns = 3;
constexpr int kPriority = 60;
constexpr double kTelemetryOnlySpeed = 10;  // times 30 frames/s
constexpr std::size_t kTelemetryOnly = 3000;
constexpr double kMoreCpu = 1.05;  // what the kernel's accounting by ticks does not tell apart

// Other programs, at normal priority, that compute while begin() to end(); made before there are threads.
class OtherPrograms {
 public:
  OtherPrograms() {
    const auto processors = static_cast<int>(std::thread::hardware_concurrency());
    for (int i = 0; i < processors; ++i) {
      const pid_t child = ::fork();
      if (child == 0) compute();
      require(child > 0, "no other program can be started");
      children_.push_back(child);
      int status = 0;
      ::waitpid(child, &status, WUNTRACED);  // it stops by itself
    }
  }
  ~OtherPrograms() {
    for (const pid_t child : children_) {
      ::kill(child, SIGKILL);
      ::waitpid(child, nullptr, 0);
    }
  }
  OtherPrograms(const OtherPrograms&) = delete;
  OtherPrograms& operator=(const OtherPrograms&) = delete;

  void begin() { tell(SIGCONT); }
  void end() { tell(SIGSTOP); }

 private:
  [[noreturn]] static void compute() {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    ::raise(SIGSTOP);
    for (volatile std::uint64_t count = 0;;) count = count + 1;
  }
  void tell(int signal) {
    for (const pid_t child : children_) ::kill(child, signal);
  }
  std::vector<pid_t> children_;
};

double cpu_s() {
  rusage use{};
  ::getrusage(RUSAGE_SELF, &use);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return seconds(use.ru_utime) + seconds(use.ru_stime);
}

struct Condition {
  std::vector<double> latencies_s;
  double cpu_s = 0;
  int oe = 0;
  std::int64_t dropped = 0;
  bool granted = true;
};

enum class Link { kRtp, kHttp };

// One turn: a link and a pipeline from their beginning to their end.
void take_turn(Link link, bool priority, const TurningCamera& camera, const Jpegs& jpegs,
               Condition* condition) {
  const double start_s = monotonic_now_s();
  const Timetable timetable(camera, jpegs, start_s);
  std::unique_ptr<RtpImages> rtp;
  std::unique_ptr<HttpSender> http;
  std::unique_ptr<FrameSource> video;
  if (link == Link::kRtp) {
    rtp = std::make_unique<RtpImages>(timetable, camera.calibration().camera);
    RtpSourceOptions options;
    options.url = rtp->url();
    video = open_rtp(options);
  } else {
    http = std::make_unique<HttpSender>(timetable);
    MjpegSourceOptions options;
    options.url = http->url();
    video = open_mjpeg(options);
  }
  PipelineOptions options;
  options.step = step_options(camera, true);
  options.step.follow_points = false;
  options.realtime = {priority ? kPriority : 0, -1, false};
  PacedPanTilt pan_tilt(camera, start_s, 1);
  TimedWriter writer;
  Pipeline pipeline(*video, pan_tilt, writer, nullptr, options);
  std::vector<double> warm_up;
  writer.write_to(&warm_up);
  pipeline.start();
  writer.wait_for(kWarmUp);
  condition->granted = !priority || fifo_thread(kPriority) > 0;
  const int oe_before = writer.oe();
  const double cpu_before_s = cpu_s();
  const std::size_t wanted = condition->latencies_s.size() + kTurn;
  writer.write_to(&condition->latencies_s);
  writer.wait_for(wanted);
  writer.write_to(nullptr);
  condition->cpu_s += cpu_s() - cpu_before_s;
  condition->oe += writer.oe() - oe_before;
  pipeline.stop();
  require(pipeline.error().empty(), pipeline.error().c_str());
  condition->dropped += pipeline.summary().drops.total();
}

void measure_telemetry_only(const TurningCamera& camera, const std::string& row,
                            LatencyReport* report) {
  const double start_s = monotonic_now_s();
  PacedVideo video(camera, start_s, kTelemetryOnlySpeed, false);
  PacedPanTilt pan_tilt(camera, start_s, kTelemetryOnlySpeed);
  PipelineOptions options;
  options.step = step_options(camera, true);
  options.step.oe.reset();
  options.step.follow_points = false;
  options.realtime = {kPriority, -1, true};
  TimedWriter writer;
  Pipeline pipeline(video, pan_tilt, writer, nullptr, options);
  std::vector<double> warm_up;
  std::vector<double> counted;
  writer.write_to(&warm_up);
  pipeline.start();
  writer.wait_for(kWarmUp);
  const int realtime_thread = fifo_thread(kPriority);
  const ThreadUse before = use_of(realtime_thread);
  writer.write_to(&counted);
  writer.wait_for(kTelemetryOnly);
  writer.write_to(nullptr);
  report->add(row, counted, use_of(realtime_thread) - before);
  pipeline.stop();
  const PipelineSummary summary = pipeline.summary();
  nlohmann::json& context = report->context()[row];
  for (const auto& [part, histogram] :
       {std::pair{"pushed", &summary.decoding}, std::pair{"waiting", &summary.waiting},
        std::pair{"computing", &summary.computing}, std::pair{"writing", &summary.writing}}) {
    context[part] = parts_of(*histogram);
  }
}

// From a thread that wakes a second one, which wakes a third, to that: at the frames' pace, with the priorities of a record's way.
void measure_wake_ups(int processor, const std::string& row, LatencyReport* report) {
  std::array<Semaphore, 2> woken;
  double sent_s = 0;
  std::vector<double> took_s;
  const auto is_over = [&] { return took_s.size() == kTelemetryOnly; };
  const auto begin = [processor](ThreadDuty duty) {
    static_cast<void>(apply_realtime({priority_of(duty, kPriority), processor, false}));
  };
  Semaphore next;
  std::thread last([&] {
    begin(ThreadDuty::kBrief);
    while (!is_over()) {
      woken[1].wait();
      took_s.push_back(monotonic_now_s() - sent_s);
      next.post();
    }
  });
  std::thread middle([&] {
    begin(ThreadDuty::kStep);
    for (std::size_t i = 0; i < kTelemetryOnly; ++i) {
      woken[0].wait();
      woken[1].post();
    }
  });
  std::thread first([&] {
    begin(ThreadDuty::kDecoding);
    for (std::size_t i = 0; i < kTelemetryOnly; ++i) {
      sleep_until(monotonic_now_s() + 1 / (30 * kTelemetryOnlySpeed));
      sent_s = monotonic_now_s();
      woken[0].post();
      next.wait();
    }
  });
  for (std::thread* thread : {&first, &middle, &last}) thread->join();
  report->add(row, took_s, {});
}

class Judge {
 public:
  void expect(bool holds, const std::string& row, const char* what, double value, double limit) {
    std::printf("%s %s: %s %.4g, limit %.4g\n", holds ? "holds" : "FAILS", row.c_str(), what, value,
                limit);
    all_hold_ = all_hold_ && holds;
  }
  [[nodiscard]] bool all_hold() const { return all_hold_; }

 private:
  bool all_hold_ = true;
};

void measure(Link link, const TurningCamera& camera, const Jpegs& jpegs, LatencyReport* report,
             Judge* judge) {
  const std::string name = link == Link::kRtp ? "rtp" : "http";
  Condition with;
  Condition without;
  for (int turn = 0; turn < kTurns; ++turn) {
    take_turn(link, true, camera, jpegs, &with);
    take_turn(link, false, camera, jpegs, &without);
  }
  const auto tell = [&](const std::string& row, const Condition& condition) {
    report->add(row, condition.latencies_s, {});
    nlohmann::json& context = report->context()[row];
    context["oe_frames"] = condition.oe;
    context["dropped"] = condition.dropped;
    context["cpu_s_per_frame"] =
        condition.cpu_s / static_cast<double>(condition.latencies_s.size());
  };
  tell(name + "/priority", with);
  tell(name + "/normal", without);
  if (!with.granted) {
    std::printf("%s: priority is not permitted; not judged\n", name.c_str());
    return;
  }
  const auto judge_tail = [&](const std::string& row, const Condition& condition, double times,
                              double more_s) {
    const double limit_s = times * quantile(condition.latencies_s, 0.5) + more_s;
    const double p99_s = quantile(condition.latencies_s, 0.99);
    judge->expect(p99_s <= limit_s, row, "p99, s", p99_s, limit_s);
  };
  judge_tail(name + "/priority", with, 2, 0.002);
  judge_tail(name + "/normal", without, 5, 0);
  judge->expect(with.cpu_s <= kMoreCpu * without.cpu_s, name, "processor time, s", with.cpu_s,
                kMoreCpu * without.cpu_s);
}

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  using namespace alidade;
  using namespace alidade::benchmarks;
  OtherPrograms others;
  cv::setNumThreads(1);
  silence_av_log();
  const TurningCamera camera(kHeight, kImages);
  const Jpegs jpegs = encoded(camera);
  LatencyReport report("busy_machine");
  Judge judge;
  measure_wake_ups(0, "two wake-ups, one processor", &report);
  measure_wake_ups(-1, "two wake-ups, any processor", &report);
  measure_telemetry_only(camera, "telemetry only", &report);
  others.begin();
  measure_telemetry_only(camera, "telemetry only, others compute", &report);
  measure(Link::kRtp, camera, jpegs, &report, &judge);
  measure(Link::kHttp, camera, jpegs, &report, &judge);
  others.end();
  constexpr double kLimit_s = 20e-6;
  const double p50_s = report.json()["rows"]["telemetry only"]["p50_s"].get<double>();
  judge.expect(p50_s <= kLimit_s, "telemetry only", "p50, s", p50_s, kLimit_s);
  report.print();
  const bool written = argc < 2 || report.write(argv[1]);
  return written && judge.all_hold() ? 0 : 1;
}
