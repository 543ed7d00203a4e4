// Processor time of a whole chain a frame, module by module, as Table 5 of Lisanti et al. has it: from a JPEG of 1280x720 to tracked targets, one
// after the other in one thread, and how many frames a second that gives; and in two threads as the paper has them, calibration and map in
// the one, detection and tracking in the other. Detection is what moves, or people on the ground at the known scale, or both; tracked is what
// they find and 24 boxes that stand. Time of the thread, so that other programs do not count; OpenCV has no threads of its own here.
// Usage: chain_table [FILE.json]

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

#include "edge_app/step/orientation_step.h"
#include "edge_app/tracking/built_in_detectors.h"
#include "edge_app/tracking/frame_view.h"
#include "edge_app/tracking/target_stage.h"
#include "platform/video/jpeg_decoder.h"
#include "test/benchmark/calibration_load.h"
#include "test/benchmark/latency_report.h"
#include "test/benchmark/sent_pictures.h"
#include "test/benchmark/turning_camera.h"
#include "test/benchmark/watched_ground.h"

namespace alidade::benchmarks {
namespace {

constexpr int kHeight = 720;
constexpr int kImages = 75;
constexpr int kWarmUp = 90;
constexpr int kFrames = 300;
constexpr int kColumns = 6, kRows = 4;  // of boxes that stand

double thread_cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// s, by module.
class Times {
 public:
  void begin() { last_s_ = thread_cpu_s(); }
  void end(const char* module) {
    const double now_s = thread_cpu_s();
    of_[module].push_back(now_s - last_s_);
    last_s_ = thread_cpu_s();
  }
  void forget() { of_.clear(); }
  [[nodiscard]] const std::vector<double>& of(const std::string& module) const {
    return of_.at(module);
  }
  [[nodiscard]] double mean_s(const std::string& module) const {
    const std::vector<double>& all = of(module);
    return std::accumulate(all.begin(), all.end(), 0.0) / static_cast<double>(all.size());
  }

 private:
  double last_s_ = 0;
  std::map<std::string, std::vector<double>> of_;
};

int run(LatencyReport* report) {
  const TurningCamera camera(kHeight, kImages);
  const Jpegs jpegs = encoded(camera);
  Streams streams(camera, 0);
  OrientationStepOptions options = step_options(camera, true);
  options.follow_points = false;
  OrientationStep step(options);
  const auto ground = watched_ground();
  // Never started: each hands over boxes, which the stage then takes.
  TargetFeed nowhere(default_target_options(TargetSpace::kPlane), ground);
  const auto detectors_of = [&](bool motion, bool people) {
    BuiltInDetectorOptions which;
    if (motion) which.motion.emplace();
    if (people) which.people.emplace();
    return std::make_unique<BuiltInDetectors>(which, ground, nullptr, nowhere);
  };
  const auto motion = detectors_of(true, false);
  const auto people = detectors_of(false, true);
  TargetStage stage(default_target_options(TargetSpace::kPlane), ground);
  JpegDecoder decoder;
  Picture picture;
  StepEvents events;
  Times times;
  int oe = 0;
  for (int k = 0; k < kWarmUp + kFrames; ++k) {
    if (k == kWarmUp) {
      times.forget();
      oe = 0;
    }
    for (int i = 0; i < kSamplesPerFrame; ++i) step.add_telemetry(streams.sample(k, i));
    const std::vector<std::uint8_t>& jpeg = jpegs[static_cast<std::size_t>(k) % jpegs.size()];
    times.begin();
    require(decoder.decode({reinterpret_cast<const char*>(jpeg.data()), jpeg.size()}, &picture),
            "a picture cannot be decoded");
    times.end("decoding");
    const ImageView image{picture.luma, picture.width, picture.height, picture.stride};
    const OrientationRecord record = step.add_frame(streams.frame(k).stamp, image, &events);
    times.end("camera pose");
    step.maintain();
    times.end("map update");
    if (!DetectorTap::takes(record)) continue;
    ++oe;
    DetectableFrame frame;
    frame.record = record;
    frame.image = image;
    times.begin();
    motion->look(frame);
    times.end("detection of motion");
    people->look(frame);
    times.end("detection of people");
    DetectedFrame detected{record, motion->boxes()};
    detected.boxes.insert(detected.boxes.end(), people->boxes().begin(), people->boxes().end());
    add_standing_boxes(kColumns, kRows, &detected);
    times.begin();
    require(is_taken(stage.add(detected).status), "detections were refused");
    times.end("tracking");
  }
  const double step_s = times.mean_s("camera pose") + times.mean_s("map update");
  for (const char* module : {"decoding", "camera pose", "map update", "detection of motion",
                             "detection of people", "tracking"}) {
    report->add(module, times.of(module), {});
    report->context()["mean_s"][module] = times.mean_s(module);
    std::printf("mean of %s: %.3f ms\n", module, 1e3 * times.mean_s(module));
  }
  report->print();
  std::printf("%d of %d frames in OE mode; %d targets\n", oe, kFrames,
              static_cast<int>(stage.state().targets.size()));
  const auto tell = [&](const std::string& what, double detection_s) {
    const double behind_s = detection_s + times.mean_s("tracking");
    const double first_s = times.mean_s("decoding") + step_s;
    const double together_s = first_s + behind_s;
    const double two_threads_s = std::max(first_s, behind_s);
    report->context()[what] = {{"sequential_s", together_s}, {"two_threads_s", two_threads_s}};
    std::printf("%s: one thread %.1f ms, %.0f frames a second; two threads %.1f ms, %.0f\n",
                what.c_str(), 1e3 * together_s, 1 / together_s, 1e3 * two_threads_s,
                1 / two_threads_s);
  };
  const double motion_s = times.mean_s("detection of motion");
  const double people_s = times.mean_s("detection of people");
  tell("motion", motion_s);
  tell("people", people_s);
  tell("both", motion_s + people_s);
  return oe;
}

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  cv::setNumThreads(1);
  alidade::benchmarks::LatencyReport report("chain");
  report.context()["oe_frames"] = alidade::benchmarks::run(&report);
  return argc < 2 || report.write(argv[1]) ? 0 : 1;
}
