// Runs each real-time stage a fixed number of times on fixed input, one thread, so that what it costs can be
// counted by a tool or timed:
//   stage_cost time FOLDER       CPU time of this thread
//   stage_cost callgrind FOLDER  for `valgrind --tool=callgrind`: dumps the counts after each piece of work
//   stage_cost mark FOLDER       for qemu with stage_count_plugin: tells it where a piece begins and ends
// FOLDER holds what stage_frames wrote. stage_cost.py runs all this.
//
// Printed, one line a piece of work, in order: STAGE CALLS, and with `time` the seconds of all calls. A piece is a
// thousand calls where one takes microseconds, else a frame. The first line names the compiler.

#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>
#if __has_include(<valgrind/callgrind.h>)
#include <valgrind/callgrind.h>
#define ALIDADE_HAS_CALLGRIND 1
#endif

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "core/model/clock_filter.h"
#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/pt_mode.h"
#include "test/benchmark/oe_stages.h"
#include "test/benchmark/paper_camera.h"
#include "test/benchmark/recorded_frames.h"
#include "test/benchmark/stage_mark.h"
#ifdef ALIDADE_WITH_PLATFORM
#include "platform/video/jpeg_decoder.h"
#endif

namespace alidade::benchmarks {
namespace {

constexpr int kPoints = LandmarkChoiceOptions().max_chosen;
constexpr std::size_t kWarmUp = 80;  // frames until the map is full
constexpr std::size_t kSettle = 4;   // frames that fill the simulated caches
constexpr std::size_t kCounted = 20;
constexpr std::size_t kStaged = 10;
constexpr int kCalls = kQueries;

// The value is needed, for all that the compiler knows.
template <class T>
void keep(const T& value) {
  asm volatile("" : : "g"(&value) : "memory");
}

void require(bool ok, const char* what) {
  if (ok) return;
  std::fprintf(stderr, "stage_cost: %s\n", what);
  std::exit(1);
}

double thread_cpu_s() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// One way to say where pieces of work begin and end.
class Meter {
 public:
  virtual ~Meter() = default;
  // All that was before is preparation.
  virtual void begin() {}
  // Until the next begin().
  virtual void end() {}
  virtual void measure(const std::string& stage, int calls, const std::function<void()>& work) = 0;
};

class Timing final : public Meter {
 public:
  void measure(const std::string& stage, int calls, const std::function<void()>& work) override {
    const double begin_s = thread_cpu_s();
    work();
    std::printf("%s %d %.9f\n", stage.c_str(), calls, thread_cpu_s() - begin_s);
  }
};

class Marking final : public Meter {
 public:
  void measure(const std::string& stage, int calls, const std::function<void()>& work) override {
    std::printf("%s %d\n", stage.c_str(), calls);
    // No such system call: the plugin alone hears of it.
    ::syscall(kStageMark, 1);
    work();
    ::syscall(kStageMark, 0);
  }
};

#ifdef ALIDADE_HAS_CALLGRIND
class Callgrind final : public Meter {
 public:
  void begin() override { CALLGRIND_START_INSTRUMENTATION; }
  void end() override { CALLGRIND_STOP_INSTRUMENTATION; }
  void measure(const std::string& stage, int calls, const std::function<void()>& work) override {
    std::printf("%s %d\n", stage.c_str(), calls);
    CALLGRIND_TOGGLE_COLLECT;
    work();
    CALLGRIND_TOGGLE_COLLECT;
    CALLGRIND_DUMP_STATS;
  }
};
#endif

std::unique_ptr<Meter> meter_of(const std::string& mode) {
  if (mode == "time") return std::make_unique<Timing>();
  if (mode == "mark") return std::make_unique<Marking>();
#ifdef ALIDADE_HAS_CALLGRIND
  if (mode == "callgrind") return std::make_unique<Callgrind>();
#endif
  return nullptr;
}

// Stamps of a camera at 30 Hz over a network: an RTP clock of 90 kHz, late by up to 2 ms.
struct Arrival {
  double receive_s;
  double sender_s;
};

std::vector<Arrival> arrivals(int count) {
  std::mt19937_64 random(1);
  std::vector<Arrival> out;
  for (int i = 0; i < count; ++i) {
    const double late_s = 1e-6 * static_cast<double>(random() % 2000);
    out.push_back({i / 30.0 + 0.01 + late_s, i * 3000 / 90000.0});
  }
  return out;
}

// Each once uncounted: what is fetched or resolved once is no part of a frame.
void cost_small_stages(Meter* meter) {
  const Calibration calibration = paper_calibration();
  const auto buffer = filled_buffer<1024>();
  const auto times = frame_times(*buffer.newest_time(), 0.2);
  const FrameOrientation frame = paper_frame();
  const auto targets = pixels();
  const auto stamps = arrivals(5 * kCalls);
  const auto samples = paper_telemetry(5 * kCalls);
  ClockFilter<> clock;
  TelemetryBuffer<1024> pushed;
  std::size_t stamp = 0;
  std::size_t sample = 0;
  std::vector<Vector3<double>> directions(targets.size());
  Matrix2<double> covariance;

  const auto update_clock = [&] {
    for (int i = 0; i < kCalls; ++i, ++stamp)
      keep(clock.update(stamps[stamp].receive_s, stamps[stamp].sender_s));
  };
  const auto push_telemetry = [&] {
    for (int i = 0; i < kCalls; ++i) keep(pushed.push(samples[sample++]));
  };
  const auto look_up = [&] {
    FrameOrientation found;
    for (const double time : times) {
      keep(pt_orientation(calibration, buffer, time, kStampSigma, &found));
      keep(found);
    }
  };
  const auto find_directions = [&] {
    for (std::size_t i = 0; i < targets.size(); ++i) {
      keep(frame.direction(targets[i], &directions[i], &covariance));
      keep(covariance);
    }
  };
  const auto find_pixels = [&] {
    Vector2<double> u;
    for (const Vector3<double>& d : directions) {
      keep(frame.pixel(d, &u, &covariance));
      keep(u);
    }
  };
  const auto both = [&](const char* stage, const std::function<void()>& work) {
    work();
    meter->begin();
    work();
    meter->measure(stage, kCalls, work);
    meter->end();
  };
  both("clock", update_clock);
  both("telemetry", push_telemetry);
  both("pt", look_up);
  both("direction", find_directions);
  both("pixel", find_pixels);
}

void cost_oe(const RecordedFrames& recorded, const std::string& name, Meter* meter) {
  const Calibration& calibration = recorded.calibration;
  OeMode mode(measured_options(calibration.camera, kPoints));
  mode.reset(calibration);
  FrameOrientation out;
  OeStatus status = OeStatus::kNotFinite;
  const std::size_t count = recorded.frames.size();
  require(count > 1, "the recording holds no frames");
  const double period_s = recorded.frames[1].time_s - recorded.frames[0].time_s;
  const auto process = [&](std::size_t k) {
    const RecordedFrame& frame = recorded.frames[k % count];
    status = mode.process(recorded.view(k % count), static_cast<double>(k) * period_s,
                          &frame.telemetry, &out);
  };
  std::size_t k = 0;
  for (; k < kWarmUp; ++k) {
    process(k);
    mode.maintain();
  }
  meter->begin();
  for (const std::size_t last = k + kSettle; k < last; ++k) {
    process(k);
    mode.maintain();
  }
  for (const std::size_t last = k + kCounted; k < last; ++k) {
    meter->measure(name + "/process", 1, [&] { process(k); });
    require(status == OeStatus::kOk, "a frame was not answered in OE mode");
    meter->measure(name + "/maintain", 1, [&] { mode.maintain(); });
  }
  OeStages stages(calibration, &mode, kPoints,
                  [&](const char* stage, const std::function<void()>& work) {
                    meter->measure(name + "/" + stage, 1, work);
                  });
  for (std::size_t i = 0; i < kStaged; ++i, ++k)
    require(stages.run(recorded.view(k % count), recorded.frames[k % count].telemetry) > 0,
            "a frame's stages found no landmarks");
  meter->end();
}

#ifdef ALIDADE_WITH_PLATFORM
void cost_jpeg(const std::string& file_name, const std::string& stage, Meter* meter) {
  std::ifstream file(file_name, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  const std::string jpeg = bytes.str();
  JpegDecoder decoder;
  Picture image;
  require(decoder.decode(jpeg, &image), "the JPEG picture cannot be decoded");
  meter->begin();
  for (int i = 0; i < 3; ++i) meter->measure(stage, 1, [&] { keep(decoder.decode(jpeg, &image)); });
  meter->end();
}
#endif

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  using namespace alidade::benchmarks;
  const std::unique_ptr<Meter> meter = argc == 3 ? meter_of(argv[1]) : nullptr;
  if (meter == nullptr) {
    std::fprintf(stderr, "usage: stage_cost time|callgrind|mark FOLDER\n");
    return 2;
  }
  std::printf("compiler %s\n", ALIDADE_COMPILER);
  cost_small_stages(meter.get());
  for (const char* height : {"720", "1080"}) {
    const std::string folder = argv[2];
    RecordedFrames recorded;
    require(read_frames(folder + "/frames-" + height, &recorded),
            "no frames in that folder; stage_frames writes them");
    cost_oe(recorded, std::string("oe-") + height, meter.get());
#ifdef ALIDADE_WITH_PLATFORM
    cost_jpeg(folder + "/picture-" + height + ".jpg", std::string("jpeg-") + height, meter.get());
#endif
  }
  return 0;
}
