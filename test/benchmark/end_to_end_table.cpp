// Latency from an image's arrival to its record written, through all of `alidade run` that a frame passes: the
// link's own thread, decoding, queues, OE mode, the record as a line of JSON. 1280x720 at 30 frames/s, recorded
// images sent on time over the loopback, once as RTP and once as MJPEG over HTTP, each with and without a
// calibration that computes beside it at the lowest priority, in turns, so that other load of the machine meets both.
//
//   rtp   from the arrival of the image's last packet
//   http  from the arrival of its first byte
//
// The real-time thread is scheduled as on a device where that is permitted; page faults and switches are its own.
// Usage: end_to_end_table [FILE.json]

#include <cstdio>
#include <string>
#include <vector>

#include "edge_app/pipeline/pipeline.h"
#include "platform/system/clock.h"
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
constexpr std::size_t kWarmUp = 90;     // frames
constexpr std::size_t kCounted = 1500;  // frames, at least, of each condition
constexpr double kLongest = 150;        // s, of counting on one link
constexpr int kPriority = 60;

// Through a link that delivers the images of a camera that began to turn at start_s.
void measure(const std::string& link, FrameSource* video, const TurningCamera& camera,
             double start_s, const Heard& heard, LatencyReport* report) {
  PipelineOptions options;
  options.step = step_options(camera, true);
  options.step.follow_points = false;
  options.realtime = {kPriority, -1, true};
  PacedPanTilt pan_tilt(camera, start_s, 1);
  TimedWriter writer;
  Pipeline pipeline(*video, pan_tilt, writer, nullptr, options);
  CalibrationThread calibration(heard);
  std::vector<double> warm_up;
  std::vector<double> with;
  std::vector<double> without;
  writer.write_to(&warm_up);
  pipeline.start();
  writer.wait_for(kWarmUp);
  const int oe_before = writer.oe();
  const int realtime_thread = fifo_thread(kPriority);
  ThreadUse with_use;
  ThreadUse without_use;
  const double begin_s = monotonic_now_s();
  while (with.size() < kCounted && monotonic_now_s() < begin_s + kLongest) {
    const ThreadUse before = use_of(realtime_thread);
    calibration.begin();
    writer.write_to(&with);
    while (!calibration.done()) {
      sleep_until(monotonic_now_s() + kLook);
      if (monotonic_now_s() > begin_s + kLongest) calibration.cancel();
    }
    writer.write_to(&without);
    const ThreadUse between = use_of(realtime_thread);
    with_use += between - before;
    writer.wait_for(with.size());
    without_use += use_of(realtime_thread) - between;
    writer.write_to(nullptr);
  }
  const int oe = writer.oe() - oe_before;
  pipeline.stop();
  require(pipeline.error().empty(), pipeline.error().c_str());
  require(!with.empty() && !without.empty(), "no frame came while the calibration computed");
  report->add(link + "/without calibration", without, without_use);
  report->add(link + "/with calibration", with, with_use);
  const PipelineSummary summary = pipeline.summary();
  nlohmann::json& context = report->context()[link];
  context["frames"] = with.size() + without.size();
  context["oe_frames"] = oe;
  context["dropped"] = summary.drops.total();
  context["calibrations"] = calibration.works();
  context["decoding"] = parts_of(summary.decoding);
  context["waiting"] = parts_of(summary.waiting);
  context["computing"] = parts_of(summary.computing);
  context["writing"] = parts_of(summary.writing);
}

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  using namespace alidade;
  using namespace alidade::benchmarks;
  cv::setNumThreads(1);
  silence_av_log();
  const TurningCamera camera(kHeight, kImages);
  const Jpegs jpegs = encoded(camera);
  const Heard heard(camera);
  LatencyReport report("end_to_end");
  {
    const double start_s = monotonic_now_s();
    const Timetable timetable(camera, jpegs, start_s);
    const RtpImages sender(timetable, camera.calibration().camera);
    RtpSourceOptions options;
    options.url = sender.url();
    const auto video = open_rtp(options);
    measure("rtp", video.get(), camera, start_s, heard, &report);
  }
  {
    const double start_s = monotonic_now_s();
    const Timetable timetable(camera, jpegs, start_s);
    const HttpSender sender(timetable);
    MjpegSourceOptions options;
    options.url = sender.url();
    const auto video = open_mjpeg(options);
    measure("http", video.get(), camera, start_s, heard, &report);
  }
  report.print();
  for (const char* link : {"rtp", "http"}) {
    const nlohmann::json& way = report.json()["context"][link];
    std::printf("%s: %d of %d frames in OE mode, %d dropped, %d calibrations;", link,
                way["oe_frames"].get<int>(), way["frames"].get<int>(), way["dropped"].get<int>(),
                way["calibrations"].get<int>());
    for (const char* part : {"decoding", "waiting", "computing", "writing"})
      std::printf(" %s p50 %.3f, p99 %.3f ms;", part, 1e3 * way[part]["p50_s"].get<double>(),
                  1e3 * way[part]["p99_s"].get<double>());
    std::printf("\n");
  }
  return argc < 2 || report.write(argv[1]) ? 0 : 1;
}
