#pragma once
// What tables of a picture's whole way have in common: the pictures of a TurningCamera sent on time over the loopback, as RTP or
// as MJPEG over HTTP, and a sink that writes records and keeps how late they were.

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <mutex>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <thread>
#include <vector>

#include "edge_app/output/record_writer.h"
#include "edge_app/pipeline/latency_histogram.h"
#include "platform/system/clock.h"
#include "platform/system/priority_mutex.h"
#include "platform/system/realtime.h"
#include "platform/video/av_handles.h"
#include "test/benchmark/paced_sources.h"
#include "test/benchmark/turning_camera.h"
#include "test/platform/support/raw_server.h"
#include "test/platform/support/rtp_sender.h"
#include "test/support/udp_port_pair.h"

namespace alidade::benchmarks {

inline constexpr int kJpegQuality = 85;
inline constexpr double kLook = 0.005;  // s
// Of what sends: a camera is another machine, which this one's load does not hold up.
inline constexpr int kSenderPriority = 90;

using Jpegs = std::vector<std::vector<std::uint8_t>>;

inline Jpegs encoded(const TurningCamera& camera) {
  Jpegs out;
  for (int k = 0; k < camera.frames(); ++k) {
    const std::vector<cv::Mat> channels(3, camera.image(k));
    cv::Mat colour;
    cv::merge(channels, colour);
    cv::imencode(".jpg", colour, out.emplace_back(), {cv::IMWRITE_JPEG_QUALITY, kJpegQuality});
  }
  return out;
}

inline void require(bool ok, const char* what) {
  if (ok) return;
  std::fprintf(stderr, "%s\n", what);
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
    static_cast<void>(apply_realtime({kSenderPriority, -1, false}));
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
      : timetable_(timetable), port_(test::udp_port_pair()) {
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
    static_cast<void>(apply_realtime({kSenderPriority, -1, false}));
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
        writer_(descriptor_, OutputFormat::kJson, "/dev/null", RecordWriter::Stalled::kDrop) {}
  ~TimedWriter() override { ::close(descriptor_); }
  TimedWriter(const TimedWriter&) = delete;
  TimedWriter& operator=(const TimedWriter&) = delete;

  bool write(const OrientationRecord& record) override {
    const bool written = writer_.write(record);
    const double now_s = monotonic_now_s();
    const std::lock_guard<PriorityMutex> lock(mutex_);
    if (!record.frame || target_ == nullptr) return written;
    target_->push_back(now_s - record.receive_time_s);
    oe_ += record.mode == RecordMode::kOe ? 1 : 0;
    return written;
  }
  void interrupt() override { writer_.interrupt(); }
  [[nodiscard]] std::string error() const override { return writer_.error(); }

  // From now on; null: nowhere.
  void write_to(std::vector<double>* target) {
    const std::lock_guard<PriorityMutex> lock(mutex_);
    target_ = target;
  }
  // Of those, so far.
  [[nodiscard]] std::size_t size() const {
    const std::lock_guard<PriorityMutex> lock(mutex_);
    return target_ == nullptr ? 0 : target_->size();
  }
  void wait_for(std::size_t frames) const {
    while (size() < frames) sleep_until(monotonic_now_s() + kLook);
  }
  [[nodiscard]] int oe() const {
    const std::lock_guard<PriorityMutex> lock(mutex_);
    return oe_;
  }

 private:
  int descriptor_;
  RecordWriter writer_;
  mutable PriorityMutex mutex_;
  std::vector<double>* target_ = nullptr;
  int oe_ = 0;
};

// Of a record's way, for the context of a report.
inline nlohmann::json parts_of(const LatencyHistogram& histogram) {
  return {{"p50_s", histogram.quantile(0.5)},
          {"p99_s", histogram.quantile(0.99)},
          {"max_s", histogram.longest_s()}};
}

}  // namespace alidade::benchmarks
