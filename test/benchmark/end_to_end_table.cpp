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

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <mutex>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <thread>
#include <vector>

#include "edge_app/output/record_writer.h"
#include "edge_app/pipeline/pipeline.h"
#include "platform/system/clock.h"
#include "platform/video/av_handles.h"
#include "platform/video/mjpeg_source.h"
#include "platform/video/rtp_source.h"
#include "test/benchmark/calibration_load.h"
#include "test/benchmark/latency_report.h"
#include "test/benchmark/paced_sources.h"
#include "test/benchmark/turning_camera.h"
#include "test/platform/support/raw_server.h"
#include "test/platform/support/rtp_sender.h"

namespace alidade::benchmarks {
namespace {

constexpr int kHeight = 720;
constexpr int kImages = 75;
constexpr int kQuality = 85;
constexpr std::size_t kWarmUp = 90;     // frames
constexpr std::size_t kCounted = 1500;  // frames, at least, of each condition
constexpr double kLongest = 150;        // s, of counting on one link
constexpr int kPriority = 60;
constexpr double kLook = 0.005;  // s

using Jpegs = std::vector<std::vector<std::uint8_t>>;

Jpegs encoded(const TurningCamera& camera) {
  Jpegs out;
  for (int k = 0; k < camera.frames(); ++k) {
    const std::vector<cv::Mat> channels(3, camera.image(k));
    cv::Mat colour;
    cv::merge(channels, colour);
    cv::imencode(".jpg", colour, out.emplace_back(), {cv::IMWRITE_JPEG_QUALITY, kQuality});
  }
  return out;
}

void require(bool ok, const char* what) {
  if (ok) return;
  std::fprintf(stderr, "end_to_end_table: %s\n", what);
  std::exit(1);
}

// The recorded images, each at its time.
class Timetable {
 public:
  Timetable(const TurningCamera& camera, const Jpegs& jpegs, double start_s)
      : camera_(camera), jpegs_(jpegs), start_s_(start_s) {}

  // The first image that is not over yet.
  [[nodiscard]] int next() const {
    return static_cast<int>(
        std::ceil(std::max(0.0, monotonic_now_s() - start_s_) / camera_.time_s(1)));
  }
  const std::vector<std::uint8_t>& wait_for(int k) const {
    sleep_until(start_s_ + camera_.time_s(k));
    return jpegs_[static_cast<std::size_t>(k) % jpegs_.size()];
  }

 private:
  const TurningCamera& camera_;
  const Jpegs& jpegs_;
  double start_s_;
};

class HttpSender {
 public:
  explicit HttpSender(const Timetable& timetable) : timetable_(timetable) {}
  [[nodiscard]] std::string url() const {
    return "http://127.0.0.1:" + std::to_string(server_.port()) + "/";
  }

 private:
  void serve(int fd) {
    if (!server_.read_request(fd)) return;
    bool open = RawServer::send(
        fd, "HTTP/1.1 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=picture\r\n\r\n");
    for (int k = timetable_.next(); open && !server_.closing(); ++k) {
      const std::vector<std::uint8_t>& jpeg = timetable_.wait_for(k);
      std::string part = "--picture\r\nContent-Type: image/jpeg\r\nContent-Length: " +
                         std::to_string(jpeg.size()) + "\r\n\r\n";
      part.append(jpeg.begin(), jpeg.end());
      open = RawServer::send(fd, part + "\r\n");
    }
  }

  const Timetable& timetable_;
  RawServer server_{[this](int fd) { serve(fd); }};
};

class RtpImages {
 public:
  RtpImages(const Timetable& timetable, const Camera<double>& camera)
      : timetable_(timetable), port_(free_rtp_port()) {
    const std::string url = "rtp://127.0.0.1:" + std::to_string(port_) + "?pkt_size=1400";
    require(avformat_alloc_output_context2(&format_, nullptr, "rtp", url.c_str()) >= 0,
            "libavformat makes no RTP");
    AVStream* stream = avformat_new_stream(format_, nullptr);
    stream->codecpar->codec_type = AVMEDIA_TYPE_VIDEO;
    stream->codecpar->codec_id = AV_CODEC_ID_MJPEG;
    stream->codecpar->format = AV_PIX_FMT_YUVJ420P;
    stream->codecpar->width = camera.width;
    stream->codecpar->height = camera.height;
    stream->time_base = {1, kClock};
    require(avio_open(&format_->pb, url.c_str(), AVIO_FLAG_WRITE) >= 0 &&
                avformat_write_header(format_, nullptr) >= 0,
            "no RTP to the loopback");
    thread_ = std::thread([this] { send(); });
  }
  ~RtpImages() {
    stopped_ = true;
    thread_.join();
    av_write_trailer(format_);
    avio_closep(&format_->pb);
    avformat_free_context(format_);
  }
  RtpImages(const RtpImages&) = delete;
  RtpImages& operator=(const RtpImages&) = delete;
  [[nodiscard]] std::string url() const { return "rtp://@:" + std::to_string(port_); }

 private:
  static constexpr int kClock = 90'000;
  static constexpr int kTicks = kClock / 30;

  void send() {
    const PacketPtr packet(av_packet_alloc());
    for (int k = timetable_.next(); !stopped_; ++k) {
      const std::vector<std::uint8_t>& jpeg = timetable_.wait_for(k);
      require(av_new_packet(packet.get(), static_cast<int>(jpeg.size())) >= 0, "no memory");
      std::copy(jpeg.begin(), jpeg.end(), packet->data);
      packet->pts = packet->dts = std::int64_t{k} * kTicks;
      require(av_write_frame(format_, packet.get()) >= 0, "a picture cannot be sent as RTP");
      av_packet_unref(packet.get());
    }
  }

  const Timetable& timetable_;
  int port_;
  AVFormatContext* format_ = nullptr;
  std::atomic<bool> stopped_{false};
  std::thread thread_;
};

// Writes records to where they cost a system call and go no further, and keeps how late they were.
class TimedWriter final : public RecordSink {
 public:
  TimedWriter()
      : descriptor_(::open("/dev/null", O_WRONLY | O_CLOEXEC)),
        writer_(descriptor_, OutputFormat::kJson, "/dev/null") {}
  ~TimedWriter() override { ::close(descriptor_); }
  TimedWriter(const TimedWriter&) = delete;
  TimedWriter& operator=(const TimedWriter&) = delete;

  bool write(const OrientationRecord& record) override {
    const bool written = writer_.write(record);
    const double now_s = monotonic_now_s();
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!record.frame || target_ == nullptr) return written;
    target_->push_back(now_s - record.receive_time_s);
    oe_ += record.mode == RecordMode::kOe ? 1 : 0;
    return written;
  }
  void interrupt() override { writer_.interrupt(); }
  [[nodiscard]] std::string error() const override { return writer_.error(); }

  // From now on; null: nowhere.
  void write_to(std::vector<double>* target) {
    const std::lock_guard<std::mutex> lock(mutex_);
    target_ = target;
  }
  // Of those, so far.
  [[nodiscard]] std::size_t size() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return target_ == nullptr ? 0 : target_->size();
  }
  void wait_for(std::size_t frames) const {
    while (size() < frames) sleep_until(monotonic_now_s() + kLook);
  }
  [[nodiscard]] int oe() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return oe_;
  }

 private:
  int descriptor_;
  RecordWriter writer_;
  mutable std::mutex mutex_;
  std::vector<double>* target_ = nullptr;
  int oe_ = 0;
};

nlohmann::json parts_of(const LatencyHistogram& histogram) {
  return {{"p50_s", histogram.quantile(0.5)},
          {"p99_s", histogram.quantile(0.99)},
          {"max_s", histogram.longest_s()}};
}

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
  const int realtime_thread = fifo_thread();
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
