#include "platform/video/rtp_source.h"

#include <atomic>
#include <chrono>
#include <cstdio>
#include <deque>
#include <mutex>
#include <utility>

#include "platform/system/clock.h"
#include "platform/system/url.h"
#include "platform/video/luma_decoder.h"
#include "platform/video/receiving_thread.h"
#include "platform/video/rtp_connection.h"
#include "platform/video/stream_copy.h"

namespace alidade {
namespace {

constexpr std::size_t kDecoderCapacity = 16;  // pictures: the most that H.264 may hold back

class RtpSource : public FrameSource {
 public:
  explicit RtpSource(const RtpSourceOptions& options) : options_(options) {
    silence_av_log();
    // The form "any interface" that libcurl takes for no URL.
    if (options_.url.rfind("rtp://@:", 0) == 0) {
      options_.url.replace(0, 8, "rtp://0.0.0.0:");
    }
    check();
  }

  ReadStatus read(Frame& frame, double timeout_s) override;

  void stop() override { thread_.stop(); }
  std::string error() const override { return error_; }
  std::string name() const override { return options_.url; }
  FrameSourceCounters counters() const override { return {damaged_, thread_.dropped()}; }

 private:
  struct Arrived {
    AccessUnit unit;
    std::shared_ptr<const AVCodecParameters> parameters;  // of the unit's connection
  };

  void check();
  void wait_for_key();
  ReadStatus receive_connection(std::string* error);
  void interrupt();
  [[nodiscard]] ReadStatus push(Arrived arrived, std::string* error);
  ReadStatus fail(std::string error) {
    error_ = options_.url + ": " + std::move(error);
    failed_ = true;
    return ReadStatus::kFailed;
  }
  ReadStatus deliver(Arrived arrived, Frame& frame);
  ReadStatus decode(AccessUnit* unit, Picture* picture);

  RtpSourceOptions options_;

  std::atomic<std::int64_t> damaged_{0};

  std::mutex mutex_;
  RtpConnection* connection_ = nullptr;  // guarded by mutex_

  // The receiving thread's own.
  bool wait_for_key_ = true;
  double waiting_since_s_ = 0;
  bool worked_ = false;  // a connection before this one has brought pictures

  // read()'s own.
  std::string error_;
  bool failed_ = false;
  bool restarted_ = true;
  std::int64_t next_frame_ = 0;
  std::shared_ptr<const AVCodecParameters> parameters_;
  LumaDecoder decoder_;
  std::deque<AccessUnit> in_decoder_;
  bool size_known_ = false;  // of this connection's pictures
  int width_ = 0;
  int height_ = 0;
  StreamCopy copy_;

  // Last: its thread uses the others.
  ReceivingThread<Arrived> thread_{options_.max_backoff_s,
                                   [this](std::string* error) { return receive_connection(error); },
                                   [this] { interrupt(); }};
};

// What the options cannot mean, before any connection; leaves the URL without credentials.
void RtpSource::check() {
  if (options_.url.find("://") == std::string::npos) {
    return;  // an SDP file: libavformat says whether it can be used
  }
  Url url;
  std::string error;
  const bool is_url = parse_url(options_.url, &url, &error);
  options_.url = url.bare;
  if (!is_url) {
    (void)fail(error);
    return;
  }
  if (options_.user.empty() && options_.password.empty()) {
    options_.user = url.user;
    options_.password = url.password;
  }
  if (url.scheme == "rtp") {
    if (url.port.empty()) {
      (void)fail("no port; write rtp://@:PORT or rtp://GROUP:PORT");
    } else if (options_.format != "MJPG" && options_.format != "H264") {
      (void)fail("unknown format '" + options_.format + "'; plain RTP needs MJPG or H264");
    }
  } else if (url.scheme != "rtsp") {
    (void)fail("not a video stream; the URL must be rtsp://, rtp:// or an .sdp file");
  }
}

// Where pictures are dropped, all are: those that follow cannot be decoded up to the next key frame.
ReadStatus RtpSource::push(Arrived arrived, std::string* error) {
  if (thread_.full()) {
    thread_.drop_all();
    wait_for_key();
  }
  if (wait_for_key_ && !arrived.unit.key) {
    if (monotonic_now_s() - waiting_since_s_ < options_.key_frame_timeout_s) {
      return ReadStatus::kOk;
    }
    char text[128];
    std::snprintf(text, sizeof text,
                  "pictures came, but no key frame for %g s; set a shorter interval of key frames "
                  "(GOP) in the camera",
                  options_.key_frame_timeout_s);
    *error = text;
    return ReadStatus::kDisconnected;
  }
  wait_for_key_ = false;
  const auto bytes = static_cast<std::size_t>(arrived.unit.packet->size);
  thread_.push(std::move(arrived), bytes);
  return ReadStatus::kOk;
}

void RtpSource::wait_for_key() {
  wait_for_key_ = true;
  waiting_since_s_ = monotonic_now_s();
}

// One connection from its beginning to its end.
ReadStatus RtpSource::receive_connection(std::string* error) {
  RtpConnection connection(options_);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    connection_ = &connection;
  }
  ReadStatus status = thread_.stopped() ? ReadStatus::kStopped : connection.open(error);
  wait_for_key();
  std::int64_t damaged = 0;
  bool works = false;
  while (status == ReadStatus::kOk) {
    Arrived arrived;
    status = connection.read(&arrived.unit, error);
    damaged_ += connection.damaged() - damaged;
    damaged = connection.damaged();
    if (status == ReadStatus::kOk) {
      arrived.parameters = connection.parameters();
      status = push(std::move(arrived), error);
      works = works || !wait_for_key_;
    }
  }
  // A camera that boots may refuse for a while what it is good for.
  if (status == ReadStatus::kFailed && worked_) status = ReadStatus::kDisconnected;
  worked_ = worked_ || works;
  const std::lock_guard<std::mutex> lock(mutex_);
  connection_ = nullptr;
  return status;
}

void RtpSource::interrupt() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (connection_ != nullptr) {
    connection_->interrupt();
  }
}

ReadStatus RtpSource::read(Frame& frame, double timeout_s) {
  const auto deadline =
      std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                             std::chrono::duration<double>(timeout_s));
  if (failed_) {
    return thread_.stopped() ? ReadStatus::kStopped : ReadStatus::kFailed;
  }
  for (;;) {
    Arrived arrived;
    std::string error;
    ReadStatus status = thread_.next(deadline, &arrived, &error);
    if (status == ReadStatus::kFailed) {
      return fail(std::move(error));
    }
    if (status == ReadStatus::kDisconnected) {
      error_ = options_.url + ": " + error;
      restarted_ = true;
    }
    if (status != ReadStatus::kOk) {
      return status;
    }
    status = deliver(std::move(arrived), frame);
    if (status != ReadStatus::kTimeout) {
      return status;
    }
  }
}

// Turns a picture's data into the frame; kTimeout if that cannot be done with this one.
ReadStatus RtpSource::deliver(Arrived arrived, Frame& frame) {
  AccessUnit unit = std::move(arrived.unit);
  if (arrived.parameters != parameters_) {
    parameters_ = std::move(arrived.parameters);
    in_decoder_.clear();
    size_known_ = false;
    if (!decoder_.open(*parameters_, true)) {
      return fail(decoder_.error());
    }
  }
  Picture picture;
  const double before_s = monotonic_now_s();
  if (options_.decode || !size_known_) {
    const ReadStatus status = decode(&unit, &picture);
    if (status != ReadStatus::kOk) {
      return status;
    }
    size_known_ = true;
    width_ = picture.width;
    height_ = picture.height;
  }
  const double decode_s = monotonic_now_s() - before_s;
  if (!options_.copy_to.empty()) {
    if (next_frame_ == 0 && !unit.key) {
      ++damaged_;  // the key frame was; a file that begins without one cannot be decoded
      return ReadStatus::kTimeout;
    }
    std::string error;
    if (!copy_.add(options_.copy_to, *parameters_, width_, height_, *unit.packet,
                   unit.receive_time_s, &error)) {
      return fail(std::move(error));
    }
  }
  frame = Frame{};
  frame.stamp.frame = next_frame_++;
  frame.stamp.receive_time_s = unit.receive_time_s;
  frame.stamp.sender_time_s = unit.sender_time_s;
  frame.stamp.sender_utc_s = unit.sender_utc_s;
  frame.stamp.restarted = std::exchange(restarted_, false);
  frame.width = width_;
  frame.height = height_;
  if (options_.decode) {
    frame.luma = picture.luma;
    frame.stride = picture.stride;
    frame.owner = std::move(picture.owner);
    frame.decode_s = decode_s;
  }
  return ReadStatus::kOk;
}

// A decoder may hold a picture back: *unit becomes the one that belongs to the picture that came out.
// kTimeout if none came.
ReadStatus RtpSource::decode(AccessUnit* unit, Picture* picture) {
  if (!decoder_.send(unit->packet.get())) {
    ++damaged_;
    return ReadStatus::kTimeout;
  }
  in_decoder_.push_back(std::move(*unit));
  LumaDecoder::Result result = LumaDecoder::Result::kDamaged;
  while (result == LumaDecoder::Result::kDamaged) {
    result = decoder_.receive(picture);
  }
  if (result == LumaDecoder::Result::kUnsupported) {
    return fail(decoder_.error());
  }
  // What lies before the picture's own packet gave no picture.
  const bool came = result == LumaDecoder::Result::kPicture;
  while (!in_decoder_.empty() && (came ? in_decoder_.front().packet->pts != picture->pts
                                       : in_decoder_.size() > kDecoderCapacity)) {
    in_decoder_.pop_front();
    ++damaged_;
  }
  if (!came || in_decoder_.empty()) {
    return ReadStatus::kTimeout;
  }
  *unit = std::move(in_decoder_.front());
  in_decoder_.pop_front();
  return ReadStatus::kOk;
}

}  // namespace

std::unique_ptr<FrameSource> open_rtp(const RtpSourceOptions& options) {
  return std::make_unique<RtpSource>(options);
}

}  // namespace alidade
