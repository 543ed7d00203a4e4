#include "platform/video/mjpeg_source.h"

#include <algorithm>
#include <atomic>
#include <cstring>
#include <optional>
#include <utility>

#include "platform/system/clock.h"
#include "platform/system/url.h"
#include "platform/video/jpeg_decoder.h"
#include "platform/video/mjpeg_connection.h"
#include "platform/video/receiving_thread.h"
#include "platform/video/remarks.h"
#include "platform/video/stamp_guard.h"
#include "platform/video/stream_copy.h"

namespace alidade {
namespace {

constexpr int kDamagedInARow = 30;  // pictures: more are not an accident
// A part without a new, plausible time stamp adds doubt of the sender's clock; each good one
// reduces it by 1.
constexpr int kDoubtOfABadStamp = 20;
constexpr int kMostDoubt = 2 * kDoubtOfABadStamp;

class MjpegSource : public FrameSource {
 public:
  explicit MjpegSource(const MjpegSourceOptions& options);
  ReadStatus read(Frame& frame, double timeout_s) override;

  void stop() override { thread_.stop(); }
  bool refuse(const std::string& reason) override {
    thread_.refuse(reason);
    return true;
  }
  std::string error() const override { return error_; }
  std::string name() const override { return name_; }
  FrameSourceCounters counters() const override {
    return {damaged_ + (connection_ ? connection_->damaged() : 0), thread_.dropped(), unstamped_};
  }
  std::string remark() override { return remarks_.take(); }
  bool keep_stream(bool keep) override {
    keeps_stream_ = keep;
    return true;
  }

 private:
  ReadStatus fail(const std::string& error) {
    error_ = name_ + ": " + error;
    failed_ = true;
    return ReadStatus::kFailed;
  }
  ReadStatus deliver(MultipartPart part, Frame& frame);
  [[nodiscard]] std::shared_ptr<const StreamPicture> coded(const std::string& jpeg, int width,
                                                           int height) const;
  void stamp_sender_time(const MultipartPart& part, FrameStamp* stamp);

  MjpegSourceOptions options_;
  std::string name_;

  std::atomic<std::int64_t> damaged_{0};
  std::atomic<std::int64_t> unstamped_{0};
  std::atomic<bool> keeps_stream_{false};
  Remarks remarks_;
  std::optional<MjpegConnection> connection_;  // none: the options are wrong

  // Used by read() only.
  std::string error_;
  bool failed_ = false;
  bool restarted_ = true;
  std::int64_t next_frame_ = 0;
  int damaged_in_a_row_ = 0;
  int clock_doubt_ = 0;  // above kMostDoubt: no sender time for the rest of the connection
  std::optional<double> last_sender_time_s_;  // of this connection, unchecked
  StampGuard stamps_;
  JpegDecoder decoder_;
  std::shared_ptr<const AVCodecParameters> parameters_ = picture_parameters(AV_CODEC_ID_MJPEG);

  // Last, as its thread uses the other members.
  ReceivingThread<MultipartPart> thread_{options_.max_backoff_s,
                                         [this](std::string* error) {
                                           return connection_->receive(
                                               [this] { return thread_.ending(); }, error);
                                         },
                                         [this] {
                                           if (connection_ && connection_->is_ready())
                                             connection_->interrupt();
                                         }};
};

MjpegSource::MjpegSource(const MjpegSourceOptions& options) : options_(options) {
  silence_av_log();
  Url url;
  std::string error;
  const bool is_url = parse_url(options.url, &url, &error);
  name_ = url.shown;
  if (!is_url) {
    (void)fail(error);
    return;
  }
  if (url.scheme != "http" && url.scheme != "https") {
    (void)fail("not an MJPEG stream; the URL must be http://host[:port]/path or https://...");
    return;
  }
  if (options_.user.empty() && options_.password.empty()) {
    options_.user = url.user;
    options_.password = url.password;
  }
  connection_.emplace(options_, url, [this](MultipartPart picture) {
    const std::size_t size = picture.body.size();
    thread_.push(std::move(picture), size);
  });
  if (!connection_->is_ready()) (void)fail(MjpegConnection::kNoCurl);
}

ReadStatus MjpegSource::read(Frame& frame, double timeout_s) {
  if (failed_) {
    return thread_.stopped() ? ReadStatus::kStopped : ReadStatus::kFailed;
  }
  return thread_.read(
      timeout_s, [&](auto part) { return deliver(std::move(part), frame); },
      [&](const std::string& error) {
        error_ = name_ + ": " + error;
        restarted_ = true;
      },
      [&](const std::string& error) { return fail(error); });
}

// Makes a frame from a part; kTimeout if this part gives none.
ReadStatus MjpegSource::deliver(MultipartPart part, Frame& frame) {
  Picture picture;
  const double before_s = monotonic_now_s();
  bool usable = decoder_.read_size(part.body, &picture.width, &picture.height);
  const bool fits = std::int64_t{picture.width} * picture.height <= options_.max_pixels;
  if (usable && fits && options_.decode) usable = decoder_.decode(part.body, &picture);
  if (!usable) {
    ++damaged_;
    if (++damaged_in_a_row_ < kDamagedInARow) {
      return ReadStatus::kTimeout;
    }
    damaged_in_a_row_ = 0;
    thread_.refuse(std::to_string(kDamagedInARow) +
                   " pictures in a row cannot be used; the last one: " + decoder_.error());
    return ReadStatus::kTimeout;
  }
  damaged_in_a_row_ = 0;
  const double decode_s = monotonic_now_s() - before_s;
  frame = Frame{};
  frame.stamp.frame = next_frame_++;
  frame.stamp.receive_time_s = part.first_byte_s;
  frame.stamp.restarted = std::exchange(restarted_, false);
  stamp_sender_time(part, &frame.stamp);
  if (keeps_stream_ && fits) frame.coded = coded(part.body, picture.width, picture.height);
  set_picture(std::move(picture), &frame);
  if (options_.decode && fits) {
    frame.decode_s = decode_s;
  }
  return ReadStatus::kOk;
}

// Null without memory.
std::shared_ptr<const StreamPicture> MjpegSource::coded(const std::string& jpeg, int width,
                                                        int height) const {
  PacketPtr packet = make_picture_packet(jpeg.size());
  if (!packet) return nullptr;
  std::memcpy(packet->data, jpeg.data(), jpeg.size());
  return std::make_shared<StreamPicture>(
      StreamPicture{std::move(packet), parameters_, width, height, true});
}

void MjpegSource::stamp_sender_time(const MultipartPart& part, FrameStamp* stamp) {
  if (stamp->restarted) {
    clock_doubt_ = 0;
    last_sender_time_s_.reset();
    stamps_.restart();
  }
  if (clock_doubt_ > kMostDoubt) {
    return;
  }
  const bool stands = !part.timestamp_s || part.timestamp_s == last_sender_time_s_;
  if (part.timestamp_s) last_sender_time_s_ = part.timestamp_s;
  auto verdict = StampGuard::Verdict::kBad;
  if (!stands) {
    const double expected_s = stamps_.expected_s(stamp->receive_time_s);
    verdict = stamps_.judge(stamp->receive_time_s, *part.timestamp_s);
    if (verdict == StampGuard::Verdict::kBad) {
      ++unstamped_;
      remarks_.say(0, name_ + ": " + bad_stamp_remark(*part.timestamp_s - expected_s));
    }
  }
  if (verdict == StampGuard::Verdict::kBad) {
    clock_doubt_ += kDoubtOfABadStamp;
    return;
  }
  const bool jumped = verdict == StampGuard::Verdict::kJumped;
  clock_doubt_ = jumped ? 0 : std::max(0, clock_doubt_ - 1);
  stamp->sender_time_s = part.timestamp_s;
  stamp->restarted = stamp->restarted || jumped;
}

}  // namespace

std::unique_ptr<FrameSource> open_mjpeg(const MjpegSourceOptions& options) {
  return std::make_unique<MjpegSource>(options);
}

}  // namespace alidade
