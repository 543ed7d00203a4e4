// Latency of each real-time stage, one call after the other on this thread: a PT look-up, directions and pixels, and
// OE mode as a whole and by its stages on frames of 720 and 1080 lines with 200 landmarks. Wall time: where another
// program takes the core, that counts. What reading the clock costs is a row of its own, and in all others.
// Usage: stage_latency_table [FILE.json]

#include <cstdio>
#include <functional>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/pt_mode.h"
#include "platform/system/clock.h"
#include "test/benchmark/latency_report.h"
#include "test/benchmark/oe_stages.h"
#include "test/benchmark/paper_camera.h"
#include "test/benchmark/turning_camera.h"
#include "test/support/allocation_guard.h"

namespace alidade::benchmarks {
namespace {

constexpr int kRounds = 50;  // of kQueries calls
constexpr int kFrames = 40;
constexpr int kWarmUp = 80;
constexpr int kCounted = 2000;
constexpr int kStaged = 1000;
constexpr int kPoints = LandmarkChoiceOptions().max_chosen;

// The times of one row's calls, and what the thread used in them.
class Row {
 public:
  // Memory that was touched: its page faults are not the calls'.
  explicit Row(std::size_t calls) : times_s_(calls) { times_s_.clear(); }

  template <class Work>
  void measure(Work&& work) {
    const ThreadUse before = thread_use();
    const test::AllocationGuard guard;
    const double begin_s = monotonic_now_s();
    work();
    const double end_s = monotonic_now_s();
    allocations_ += guard.count();
    use_ += thread_use() - before;
    times_s_.push_back(end_s - begin_s);
  }
  // What the thread used of all together: calls of microseconds would drown in asking after each.
  template <class Work>
  void measure_all(int calls, Work&& work) {
    const ThreadUse before = thread_use();
    const test::AllocationGuard guard;
    for (int i = 0; i < calls; ++i) {
      const double begin_s = monotonic_now_s();
      work(i);
      times_s_.push_back(monotonic_now_s() - begin_s);
    }
    allocations_ += guard.count();
    use_ += thread_use() - before;
  }
  void add_to(LatencyReport* report, const std::string& name) const {
    ThreadUse use = use_;
    use.allocations = allocations_;
    report->add(name, times_s_, use);
  }

 private:
  std::vector<double> times_s_;
  ThreadUse use_;
  std::int64_t allocations_ = 0;
};

template <class T>
void keep(const T& value) {
  asm volatile("" : : "g"(&value) : "memory");
}

void measure_pt(LatencyReport* report) {
  const Calibration calibration = paper_calibration();
  const auto buffer = filled_buffer<1024>();
  const auto times = frame_times(*buffer.newest_time(), 0.2);
  const FrameOrientation frame = paper_frame();
  const auto targets = pixels();
  Matrix2<double> covariance;
  const auto row = [&](const char* name, const std::function<void(std::size_t)>& call) {
    Row calls(kRounds * kQueries);
    calls.measure_all(kRounds * kQueries,
                      [&](int i) { call(static_cast<std::size_t>(i % kQueries)); });
    calls.add_to(report, name);
  };
  row("reading the clock", [](std::size_t) {});
  row("pt", [&](std::size_t i) {
    FrameOrientation found;
    keep(pt_orientation(calibration, buffer, times[i], kStampSigma, &found));
    keep(found);
  });
  std::vector<Vector3<double>> directions(targets.size());
  row("direction",
      [&](std::size_t i) { keep(frame.direction(targets[i], &directions[i], &covariance)); });
  row("pixel", [&](std::size_t i) {
    Vector2<double> u;
    keep(frame.pixel(directions[i], &u, &covariance));
    keep(u);
  });
}

void measure_oe(int height, LatencyReport* report) {
  TurningCamera camera(height, kFrames);
  OeMode mode(measured_options(camera.calibration().camera, kPoints));
  mode.reset(camera.calibration());
  FrameOrientation frame;
  Row process(kCounted);
  Row maintain(kCounted);
  int oe_frames = 0;
  for (int k = 0; k < kWarmUp + kCounted; ++k) {
    const InterpolatedPanTilt telemetry = camera.telemetry(k);
    OeStatus status = OeStatus::kNotFinite;
    const auto answer = [&] {
      status = mode.process(camera.view(k), camera.time_s(k), &telemetry, &frame);
    };
    if (k < kWarmUp) {
      answer();
      mode.maintain();
      continue;
    }
    process.measure(answer);
    maintain.measure([&] { mode.maintain(); });
    oe_frames += status == OeStatus::kOk ? 1 : 0;
  }
  const std::string name = "oe-" + std::to_string(height);
  process.add_to(report, name + "/process");
  maintain.add_to(report, name + "/maintain");
  std::map<std::string, Row> stages;
  OeStages staged(camera.calibration(), &mode, kPoints,
                  [&](const char* stage, const std::function<void()>& work) {
                    stages.try_emplace(stage, kStaged).first->second.measure(work);
                  });
  for (int k = 0; k < kStaged; ++k)
    static_cast<void>(staged.run(camera.view(k), camera.telemetry(k)));
  for (const auto& [stage, row] : stages) row.add_to(report, name + "/" + stage);
  report->context()[name + "/frames in OE mode"] = oe_frames;
}

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  using namespace alidade::benchmarks;
  cv::setNumThreads(1);
  LatencyReport report("stage_latency");
  measure_pt(&report);
  for (const int height : {720, 1080}) measure_oe(height, &report);
  report.print();
  return argc < 2 || report.write(argv[1]) ? 0 : 1;
}
