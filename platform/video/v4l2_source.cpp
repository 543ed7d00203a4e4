#include "platform/video/v4l2_source.h"

#include <linux/videodev2.h>
#include <poll.h>
#include <sys/eventfd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstring>
#include <string_view>
#include <utility>

#include "platform/system/backoff.h"
#include "platform/system/clock.h"
#include "platform/system/file_descriptor.h"
#include "platform/video/jpeg_decoder.h"
#include "platform/video/luma_pool.h"
#include "platform/video/stream_copy.h"
#include "platform/video/v4l2_device.h"
#include "platform/video/v4l2_stamps.h"

namespace alidade {
namespace {

constexpr double kLongestPoll_s = 3600;  // so that milliseconds fit into an int

std::string_view bytes_of(const V4l2Device::Buffer& buffer) {
  return {reinterpret_cast<const char*>(buffer.data), buffer.bytes};
}

std::size_t pixels(const Picture& picture) {
  return static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height);
}

class V4l2Source : public FrameSource {
 public:
  explicit V4l2Source(const V4l2SourceOptions& options)
      : options_(options), stop_event_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    silence_av_log();
    if (!stop_event_.is_open()) {
      (void)fail("no file descriptor is left");
    }
  }
  ~V4l2Source() override { close(); }

  ReadStatus read(Frame& frame, double timeout_s) override;
  void stop() override {
    stopped_ = true;
    if (stop_event_.is_open()) {
      (void)::eventfd_write(stop_event_.get(), 1);
    }
  }
  std::string error() const override { return error_; }
  std::string name() const override { return options_.device; }
  FrameSourceCounters counters() const override { return {damaged_, dropped_}; }
  bool keep_stream(bool keep) override {
    keeps_stream_ = keep;
    return true;
  }

 private:
  ReadStatus connect(double end_s);
  ReadStatus take(Frame& frame);
  bool take_picture(const V4l2Device::Buffer& buffer, const std::shared_ptr<const void>& held,
                    Picture* picture);
  [[nodiscard]] std::shared_ptr<const StreamPicture> coded(const V4l2Device::Buffer& buffer,
                                                           const Picture& picture) const;
  bool wait(int fd, double end_s, bool* gone);
  void close();
  ReadStatus lose(const std::string& error);
  ReadStatus fail(const std::string& error) {
    error_ = options_.device + ": " + error;
    failed_ = true;
    return ReadStatus::kFailed;
  }

  V4l2SourceOptions options_;
  FileDescriptor stop_event_;  // readable for good once stop() was called
  std::atomic<bool> stopped_{false};
  std::atomic<std::int64_t> damaged_{0};
  std::atomic<std::int64_t> dropped_{0};
  std::atomic<bool> keeps_stream_{false};

  std::string error_;
  bool failed_ = false;
  bool worked_ = false;  // a frame has come
  bool lost_ = false;    // kDisconnected was reported
  Backoff backoff_{options_.max_backoff_s};
  double next_try_s_ = 0;
  std::shared_ptr<V4l2Device> device_;  // null without a connection
  V4l2Stamps stamps_;
  double last_frame_s_ = 0;     // time of the last delivery, or start of the connection
  bool damaged_since_ = false;  // damaged buffers came since the last frame
  bool restarted_ = true;
  std::int64_t next_frame_ = 0;
  JpegDecoder decoder_;
  LumaPool pool_;
  // Of Frame::coded: JPEG unchanged, or uncompressed luma.
  std::shared_ptr<const AVCodecParameters> parameters_;
};

void V4l2Source::close() {
  if (device_) {
    device_->close();  // lent buffers keep the object alive
    device_.reset();
  }
}

ReadStatus V4l2Source::lose(const std::string& error) {
  close();
  error_ = options_.device + ": " + error;
  restarted_ = true;
  lost_ = true;
  next_try_s_ = monotonic_now_s() + backoff_.next_s();
  return ReadStatus::kDisconnected;
}

// Waits until fd (if not negative) is ready, end_s or stop(). False: fd is not ready.
bool V4l2Source::wait(int fd, double end_s, bool* gone) {
  const double left_s = std::clamp(end_s - monotonic_now_s(), 0.0, kLongestPoll_s);
  std::array<pollfd, 2> polled = {{{stop_event_.get(), POLLIN, 0}, {fd, POLLIN, 0}}};
  (void)::poll(polled.data(), polled.size(), static_cast<int>(std::ceil(1e3 * left_s)));
  *gone = (polled[1].revents & (POLLERR | POLLHUP | POLLNVAL)) != 0;
  return polled[1].revents != 0;
}

ReadStatus V4l2Source::connect(double end_s) {
  bool gone = false;
  if (next_try_s_ > monotonic_now_s()) {
    (void)wait(-1, std::min(end_s, next_try_s_), &gone);
    if (stopped_) {
      return ReadStatus::kStopped;
    }
    if (next_try_s_ > monotonic_now_s()) {
      return ReadStatus::kTimeout;
    }
  }
  auto device = std::make_shared<V4l2Device>();
  const V4l2Device::Result result = device->open(options_.device, options_.wish);
  const bool for_good =
      result == V4l2Device::Result::kUnusable || (result == V4l2Device::Result::kDenied && !lost_);
  if (for_good && !worked_) {
    return fail(device->error());
  }
  if (result != V4l2Device::Result::kOk) {
    return lose(device->error());
  }
  device_ = std::move(device);
  parameters_ = picture_parameters(device_->format() == V4l2Format::kMjpg ? AV_CODEC_ID_MJPEG
                                                                          : AV_CODEC_ID_RAWVIDEO);
  stamps_ = V4l2Stamps();
  last_frame_s_ = monotonic_now_s();
  damaged_since_ = false;
  return ReadStatus::kOk;
}

ReadStatus V4l2Source::read(Frame& frame, double timeout_s) {
  const double end_s = monotonic_now_s() + timeout_s;
  for (;;) {
    if (stopped_) {
      return ReadStatus::kStopped;
    }
    if (failed_) {
      return ReadStatus::kFailed;
    }
    if (!device_) {
      const ReadStatus status = connect(end_s);
      if (status != ReadStatus::kOk) {
        return status;
      }
    }
    const double silence_s = last_frame_s_ + options_.timeout_s;
    bool gone = false;
    if (wait(device_->fd(), std::min(end_s, silence_s), &gone)) {
      const ReadStatus status = gone ? lose("the device is gone") : take(frame);
      if (status != ReadStatus::kTimeout) {
        return status;
      }
    }
    const double now_s = monotonic_now_s();
    if (now_s >= silence_s && !stopped_) {
      return lose(std::string(damaged_since_ ? "pictures come, but no whole one" : "no picture") +
                  " within " + std::to_string(std::lround(1e3 * options_.timeout_s)) + " ms");
    }
    if (now_s >= end_s && !stopped_) {
      return ReadStatus::kTimeout;
    }
  }
}

// Makes a frame from the next buffer; kTimeout if it gives none.
ReadStatus V4l2Source::take(Frame& frame) {
  V4l2Device::Buffer buffer;
  const V4l2Device::Result result = device_->dequeue(&buffer);
  if (result != V4l2Device::Result::kOk) {
    return result == V4l2Device::Result::kNothing ? ReadStatus::kTimeout : lose(device_->error());
  }
  const std::shared_ptr<const void> held = device_->hold(buffer.index);
  const V4l2Stamps::Stamp stamp =
      stamps_.update(buffer.sequence, buffer.flags, buffer.stamp_s, monotonic_now_s());
  dropped_ += stamp.lost;
  restarted_ = restarted_ || stamp.anew;
  if (stamp.duplicate) {
    return ReadStatus::kTimeout;
  }
  Picture picture;
  const double before_s = monotonic_now_s();
  if ((buffer.flags & V4L2_BUF_FLAG_ERROR) != 0 || !take_picture(buffer, held, &picture)) {
    ++damaged_;
    damaged_since_ = true;
    return ReadStatus::kTimeout;
  }
  const double decode_s = monotonic_now_s() - before_s;
  frame = Frame{};
  frame.stamp.frame = next_frame_++;
  frame.stamp.receive_time_s = stamp.receive_time_s;
  frame.stamp.stamped_at = stamp.stamped_at;
  frame.stamp.sequence = stamp.sequence;
  frame.stamp.restarted = std::exchange(restarted_, false);
  if (keeps_stream_) frame.coded = coded(buffer, picture);
  set_picture(std::move(picture), &frame);
  if (options_.decode) {
    frame.decode_s = decode_s;
  }
  last_frame_s_ = monotonic_now_s();
  damaged_since_ = false;
  worked_ = true;
  backoff_.reset();
  return ReadStatus::kOk;
}

// Size and, if wanted, luma. False: the buffer does not hold a complete picture.
bool V4l2Source::take_picture(const V4l2Device::Buffer& buffer,
                              const std::shared_ptr<const void>& held, Picture* picture) {
  const V4l2Format format = device_->format();
  if (format == V4l2Format::kMjpg) {
    const std::string_view jpeg = bytes_of(buffer);
    return options_.decode ? decoder_.decode(jpeg, picture)
                           : decoder_.read_size(jpeg, &picture->width, &picture->height);
  }
  const int width = device_->width();
  const int height = device_->height();
  if (buffer.bytes < raw_picture_bytes(format, width, height, device_->stride())) {
    return false;
  }
  picture->width = width;
  picture->height = height;
  if (!options_.decode) {
    return true;
  }
  if (luma_step(format) == 1 && device_->can_lend()) {
    picture->luma = buffer.data;
    picture->stride = static_cast<std::ptrdiff_t>(device_->stride());
    picture->owner = held;
    return true;
  }
  const std::shared_ptr<std::uint8_t> luma = pool_.take(pixels(*picture));
  copy_luma(format, buffer.data, width, height, device_->stride(), luma.get());
  picture->luma = luma.get();
  picture->stride = width;
  picture->owner = luma;
  return true;
}

// Null without memory.
std::shared_ptr<const StreamPicture> V4l2Source::coded(const V4l2Device::Buffer& buffer,
                                                       const Picture& picture) const {
  const V4l2Format format = device_->format();
  const bool jpeg = format == V4l2Format::kMjpg;
  const std::size_t bytes = jpeg ? buffer.bytes : pixels(picture);
  PacketPtr packet = make_picture_packet(bytes);
  if (!packet) return nullptr;
  if (jpeg) {
    std::memcpy(packet->data, buffer.data, bytes);
  } else {
    copy_luma(format, buffer.data, picture.width, picture.height, device_->stride(), packet->data);
  }
  return std::make_shared<StreamPicture>(
      StreamPicture{std::move(packet), parameters_, picture.width, picture.height, true});
}

}  // namespace

std::unique_ptr<FrameSource> open_v4l2(const V4l2SourceOptions& options) {
  return std::make_unique<V4l2Source>(options);
}

}  // namespace alidade
