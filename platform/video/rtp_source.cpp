#include "platform/video/rtp_source.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdio>
#include <deque>
#include <mutex>
#include <utility>

#include "platform/system/clock.h"
#include "platform/system/url.h"
#include "platform/video/luma_decoder.h"
#include "platform/video/receiving_thread.h"
#include "platform/video/remarks.h"
#include "platform/video/rtp_connection.h"
#include "platform/video/stream_copy.h"

namespace alidade {
namespace {

constexpr std::size_t kDecoderCapacity = 16;  // pictures: the most that H.264 may hold back
constexpr double kWorthSaying_s = 3;          // most cameras send key frames more often

// The decoder counts whole blocks at a picture's edges.
std::int64_t with_whole_blocks(std::int64_t pixels) {
  constexpr std::int64_t kBlock = 64;  // px, H.265's largest
  return pixels + 2 * kBlock * (kMostPictureSide + kBlock);
}

void begin_waiting(std::atomic<double>* since_s) {
  if (*since_s < 0) *since_s = monotonic_now_s();
}

class RtpSource : public FrameSource {
 public:
  explicit RtpSource(const RtpSourceOptions& options) : options_(options) {
    silence_av_log();
    // The form for "any interface", which libcurl does not accept as a URL.
    if (options_.url.rfind("rtp://@:", 0) == 0) {
      options_.url.replace(0, 8, "rtp://0.0.0.0:");
    }
    name_ = options_.url;
    check();
  }

  ReadStatus read(Frame& frame, double timeout_s) override;

  void stop() override { thread_.stop(); }
  bool refuse(const std::string& reason) override {
    choice_.give_up();
    thread_.refuse(reason);
    return true;
  }
  std::string error() const override { return error_; }
  std::string name() const override { return name_; }
  FrameSourceCounters counters() const override {
    return {damaged_, thread_.dropped(), unstamped_, foreign_packets_, garbage_bytes_};
  }
  std::string waiting() const override;
  std::string remark() override { return remarks_.take(); }
  bool keep_stream(bool keep) override {
    keeps_stream_ = keep;
    return true;
  }

 private:
  // How much of a connection's counts was added to the counters.
  struct Counted {
    std::int64_t damaged = 0;
    std::int64_t unstamped = 0;
    std::int64_t foreign_packets = 0;
    std::int64_t garbage_bytes = 0;
  };
  struct Arrived {
    AccessUnit unit;
    std::shared_ptr<const AVCodecParameters> parameters;  // of the unit's connection
  };

  enum Remark { kForeignPackets, kGarbage, kBadStamp };

  void check();
  void count(const RtpConnection& connection);
  ReadStatus receive_connection(std::string* error);
  void interrupt();
  void push(Arrived arrived);
  ReadStatus fail(std::string error) {
    error_ = name_ + ": " + std::move(error);
    failed_ = true;
    return ReadStatus::kFailed;
  }
  // A peer's content ends the program only before the first frame; later it ends the connection.
  ReadStatus fail_or_refuse(const std::string& error) {
    if (next_frame_ == 0) return fail(error);
    choice_.give_up();
    thread_.refuse(error);
    return ReadStatus::kTimeout;
  }
  ReadStatus deliver(Arrived arrived, Frame& frame);
  void give(const AccessUnit& unit, int width, int height, Frame& frame);
  [[nodiscard]] std::shared_ptr<const StreamPicture> coded(AccessUnit* unit);
  [[nodiscard]] bool can_be_decoded(const AccessUnit& unit);
  ReadStatus decode(AccessUnit* unit, Picture* picture);
  void spoil();

  RtpSourceOptions options_;
  std::string name_;  // as shown: its query may hold a password

  std::atomic<std::int64_t> damaged_{0};
  std::atomic<std::int64_t> unstamped_{0};
  std::atomic<std::int64_t> foreign_packets_{0};
  std::atomic<std::int64_t> garbage_bytes_{0};
  std::atomic<bool> keeps_stream_{false};
  Remarks remarks_;

  // Since when pictures have come that need a key frame before them (CLOCK_MONOTONIC); < 0: none is
  // awaited. First: at the start of a connection, or after pictures were dropped for a slow
  // reader. Second: after a loss.
  std::atomic<double> no_first_key_since_s_{-1};
  std::atomic<double> no_key_after_loss_since_s_{-1};

  SenderChoice choice_{options_.timeout_s};  // plain RTP

  std::mutex mutex_;
  RtpConnection* connection_ = nullptr;  // guarded by mutex_

  // Used by the receiving thread only.
  bool wait_for_key_ = true;
  bool worked_ = false;  // an earlier connection has brought pictures
  Counted counted_;      // of this connection

  // Used by read() only.
  std::string error_;
  bool failed_ = false;
  bool restarted_ = true;
  std::int64_t next_frame_ = 0;
  std::shared_ptr<const AVCodecParameters> parameters_;
  LumaDecoder decoder_;
  bool spoilt_ = false;  // a picture that later ones depend on is lost or damaged
  // Likewise, and no picture has come since that needs none before it: where decoding could go on,
  // a file would not show that a picture is missing.
  bool gap_ = false;
  bool kept_from_start_ = false;  // of this connection
  bool any_kept_ = false;         // of this connection
  std::deque<AccessUnit> in_decoder_;
  bool size_known_ = false;  // of this connection's pictures
  int width_ = 0;
  int height_ = 0;

  // Last, as its thread uses the other members.
  ReceivingThread<Arrived> thread_{options_.max_backoff_s,
                                   [this](std::string* error) { return receive_connection(error); },
                                   [this] { interrupt(); }};
};

// Checks the options before any connection; removes credentials from the URL.
void RtpSource::check() {
  if (options_.url.find("://") == std::string::npos) {
    return;  // an SDP file: libavformat reports if it is unusable
  }
  Url url;
  std::string error;
  const bool is_url = parse_url(options_.url, &url, &error);
  options_.url = url.bare;
  name_ = url.shown;
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
    } else if (options_.format != "MJPG" && options_.format != "H264" &&
               options_.format != "H265") {
      (void)fail("unknown format '" + options_.format + "'; plain RTP needs MJPG, H264 or H265");
    }
  } else if (url.scheme == "rtsps") {
    if (options_.transport == RtpSourceOptions::Transport::kUdp) {
      (void)fail("over TLS the pictures come within the connection; set transport: tcp");
    }
  } else if (url.scheme != "rtsp") {
    (void)fail("not a video stream; the URL must be rtsp://, rtsps://, rtp:// or an .sdp file");
  }
}

// If pictures are dropped, all are: none can be decoded until the next key frame.
void RtpSource::push(Arrived arrived) {
  if (thread_.full(static_cast<std::size_t>(arrived.unit.packet->size))) {
    thread_.drop_all();
    wait_for_key_ = true;
  }
  if (wait_for_key_ && !arrived.unit.key) {
    begin_waiting(&no_first_key_since_s_);
    return;
  }
  // The decoder did not get the pictures before it.
  if (std::exchange(wait_for_key_, false)) arrived.unit.follows = false;
  no_first_key_since_s_ = -1;
  const auto bytes = static_cast<std::size_t>(arrived.unit.packet->size);
  thread_.push(std::move(arrived), bytes);
}

std::string RtpSource::waiting() const {
  const double now_s = monotonic_now_s();
  double waited_s = 0;
  for (const double since_s : {no_first_key_since_s_.load(), no_key_after_loss_since_s_.load()}) {
    if (since_s >= 0) waited_s = std::max(waited_s, now_s - since_s);
  }
  if (waited_s < kWorthSaying_s) return "";
  char text[128];
  std::snprintf(text, sizeof text,
                "waiting for a key frame since %.0f s; set a shorter interval of key frames (GOP) "
                "in the camera",
                std::floor(waited_s));
  return name_ + ": " + text;
}

// One connection from start to end.
ReadStatus RtpSource::receive_connection(std::string* error) {
  RtpConnection connection(options_, &choice_);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    connection_ = &connection;
  }
  ReadStatus status = thread_.ending() ? ReadStatus::kStopped : connection.open(error);
  wait_for_key_ = true;
  counted_ = {};
  bool works = false;
  while (status == ReadStatus::kOk) {
    Arrived arrived;
    status = connection.read(&arrived.unit, error);
    count(connection);
    if (status == ReadStatus::kOk) {
      arrived.parameters = connection.parameters();
      push(std::move(arrived));
      works = works || !wait_for_key_;
    }
  }
  no_first_key_since_s_ = -1;
  // A booting camera may refuse for a while. A peer's content does not end a program that it has
  // served.
  worked_ = worked_ || works;
  if (status == ReadStatus::kFailed && worked_) status = ReadStatus::kDisconnected;
  const std::lock_guard<std::mutex> lock(mutex_);
  connection_ = nullptr;
  return status;
}

void RtpSource::count(const RtpConnection& connection) {
  const Counted now{connection.damaged(), connection.bad_stamps(), connection.foreign(),
                    connection.garbage()};
  damaged_ += now.damaged - counted_.damaged;
  unstamped_ += now.unstamped - counted_.unstamped;
  foreign_packets_ += now.foreign_packets - counted_.foreign_packets;
  garbage_bytes_ += now.garbage_bytes - counted_.garbage_bytes;
  const std::string of = name_ + ": ";
  if (now.foreign_packets > counted_.foreign_packets) {
    remarks_.say(kForeignPackets, of + "packets of " + connection.foreign_kind() +
                                      " come between those of the video; the session did not "
                                      "announce them, so they are counted and left out");
  }
  if (now.garbage_bytes > counted_.garbage_bytes) {
    remarks_.say(kGarbage, of + "bytes come that belong to no packet; they are counted and "
                                "skipped: a fault of the camera, or of a relay in between");
  }
  if (now.unstamped > counted_.unstamped) {
    remarks_.say(kBadStamp, of + bad_stamp_remark(connection.bad_stamp_off_s()));
  }
  counted_ = now;
}

void RtpSource::interrupt() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (connection_ != nullptr) {
    connection_->interrupt();
  }
}

ReadStatus RtpSource::read(Frame& frame, double timeout_s) {
  if (failed_) {
    return thread_.stopped() ? ReadStatus::kStopped : ReadStatus::kFailed;
  }
  return thread_.read(
      timeout_s, [&](auto arrived) { return deliver(std::move(arrived), frame); },
      [&](const std::string& error) {
        error_ = name_ + ": " + error;
        restarted_ = true;
        no_key_after_loss_since_s_ = -1;
      },
      [&](const std::string& error) { return fail(error); });
}

// Makes a frame from a picture's data; kTimeout if this picture gives none.
ReadStatus RtpSource::deliver(Arrived arrived, Frame& frame) {
  AccessUnit unit = std::move(arrived.unit);
  const bool keeps = keeps_stream_;
  restarted_ = restarted_ || unit.begins_anew;
  if (arrived.parameters != parameters_) {
    parameters_ = std::move(arrived.parameters);
    in_decoder_.clear();
    size_known_ = false;
    spoilt_ = false;
    gap_ = false;
    kept_from_start_ = keeps;
    any_kept_ = false;
    if (!decoder_.open(*parameters_, true, with_whole_blocks(options_.max_pixels))) {
      return fail_or_refuse(decoder_.error());
    }
  }
  Picture picture;
  const double before_s = monotonic_now_s();
  if (unit.too_large) {
    spoil();
    give(unit, unit.width, unit.height, frame);
    return ReadStatus::kOk;
  }
  bool can_be_kept = keeps;
  if (options_.decode || keeps || !size_known_) {
    const bool decodable = can_be_decoded(unit);
    if (!decodable && !unit.whole) return ReadStatus::kTimeout;
    can_be_kept = can_be_kept && decodable && !gap_;
    if (decodable && (options_.decode || !size_known_)) {
      const ReadStatus status = decode(&unit, &picture);
      if (status == ReadStatus::kFailed) return status;
      const bool begins = !spoilt_ && decoder_.is_beginning();
      if (status != ReadStatus::kOk && !begins) return status;
      can_be_kept = can_be_kept && status == ReadStatus::kOk;
    }
  }
  if (!size_known_) return ReadStatus::kTimeout;
  const double decode_s = monotonic_now_s() - before_s;
  give(unit, width_, height_, frame);
  if (can_be_kept) frame.coded = coded(&unit);
  if (options_.decode && picture.luma != nullptr) {
    frame.luma = picture.luma;
    frame.stride = picture.stride;
    frame.chroma = picture.chroma;
    frame.owner = std::move(picture.owner);
    frame.decode_s = decode_s;
    frame.interlaced = picture.interlaced;
  }
  return ReadStatus::kOk;
}

// Fills a frame without luma.
void RtpSource::give(const AccessUnit& unit, int width, int height, Frame& frame) {
  frame = Frame{};
  frame.stamp.frame = next_frame_++;
  frame.stamp.receive_time_s = unit.receive_time_s;
  frame.stamp.sender_time_s = unit.sender_time_s;
  frame.stamp.sender_utc_s = unit.sender_utc_s;
  frame.stamp.restarted = std::exchange(restarted_, false);
  frame.width = width;
  frame.height = height;
}

std::shared_ptr<const StreamPicture> RtpSource::coded(AccessUnit* unit) {
  const bool first = !std::exchange(any_kept_, true);
  return std::make_shared<StreamPicture>(StreamPicture{std::move(unit->packet), parameters_, width_,
                                                       height_,
                                                       unit->key || (first && kept_from_start_)});
}

// True if the picture and all that it depends on are complete. After a loss that holds again from
// the next picture at which decoding can start.
bool RtpSource::can_be_decoded(const AccessUnit& unit) {
  if (!unit.whole) ++damaged_;
  if (!unit.whole || !unit.follows) spoil();
  if (unit.whole && (unit.packet->flags & AV_PKT_FLAG_KEY) != 0) gap_ = false;
  if (spoilt_) {
    if (!unit.whole || !unit.key) return false;
    decoder_.flush();
    in_decoder_.clear();
    spoilt_ = false;
  }
  if (!options_.decode && size_known_ && !gap_) no_key_after_loss_since_s_ = -1;
  return true;
}

// Later pictures cannot be decoded, as one that they depend on is missing.
void RtpSource::spoil() {
  spoilt_ = true;
  gap_ = true;
  begin_waiting(&no_key_after_loss_since_s_);
}

// A decoder may hold a picture back: *unit becomes the one that belongs to the returned picture.
// kTimeout if none came out; *unit is unchanged then if decoding has only started.
ReadStatus RtpSource::decode(AccessUnit* unit, Picture* picture) {
  const bool others_need_it = coded_by(parameters_->codec_id).has_value();
  bool damaged = !decoder_.send(unit->packet.get());
  if (decoder_.keeps_too_many()) return fail_or_refuse(decoder_.error());
  LumaDecoder::Result result = LumaDecoder::Result::kNone;
  if (!damaged) {
    in_decoder_.push_back(std::move(*unit));
    do {
      result = decoder_.receive(picture);
      damaged = damaged || result == LumaDecoder::Result::kDamaged;
    } while (result == LumaDecoder::Result::kDamaged);
    if (result == LumaDecoder::Result::kUnsupported) return fail_or_refuse(decoder_.error());
    damaged = damaged && others_need_it;
  }
  if (damaged) {
    ++damaged_;
    if (others_need_it) {
      in_decoder_.clear();
      spoil();
    }
    return ReadStatus::kTimeout;
  }
  const bool came = result == LumaDecoder::Result::kPicture;
  if (!came && decoder_.is_beginning()) {
    *unit = std::move(in_decoder_.back());
    in_decoder_.clear();
    return ReadStatus::kTimeout;
  }
  // Units before the one of this picture gave no picture.
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
  size_known_ = true;
  choice_.keep(unit->trial);
  width_ = picture->width;
  height_ = picture->height;
  no_key_after_loss_since_s_ = -1;
  return ReadStatus::kOk;
}

}  // namespace

std::unique_ptr<FrameSource> open_rtp(const RtpSourceOptions& options) {
  return std::make_unique<RtpSource>(options);
}

}  // namespace alidade
