#include "platform/video/video_file.h"

#include <atomic>
#include <utility>

#include "platform/video/av_file.h"
#include "platform/video/luma_decoder.h"

namespace alidade {
namespace {

class VideoFile : public FrameSource {
 public:
  explicit VideoFile(std::string path) : path_(std::move(path)) { silence_av_log(); }

  ReadStatus read(Frame& frame, double timeout_s) override;
  void stop() override { stopped_ = true; }
  std::string error() const override { return error_; }
  std::string name() const override { return path_; }
  FrameSourceCounters counters() const override { return {damaged_, 0}; }

 private:
  [[nodiscard]] bool open();
  void feed();

  std::string path_;
  std::string error_;
  AvFile file_;
  LumaDecoder decoder_;
  std::int64_t frames_ = 0;
  std::int64_t damaged_ = 0;
  bool drained_ = false;
  bool failed_ = false;
  std::atomic<bool> stopped_{false};
};

bool VideoFile::open() {
  if (!file_.open(path_, &error_)) {
    error_ += "; expected a video file";
    return false;
  }
  if (!decoder_.open(*file_.stream().codecpar, false)) {
    error_ = path_ + ": " + decoder_.error();
    return false;
  }
  return true;
}

// Feeds the decoder one more packet, or the end of the stream at the end of the file or where it is
// cut off.
void VideoFile::feed() {
  const PacketPtr packet(av_packet_alloc());
  if (!file_.read(packet.get())) {
    drained_ = true;
    (void)decoder_.send(nullptr);
  } else if (!decoder_.send(packet.get())) {
    ++damaged_;
  }
}

ReadStatus VideoFile::read(Frame& frame, double /*timeout_s*/) {
  if (failed_) return ReadStatus::kFailed;
  if (!file_.is_open() && !open()) {
    failed_ = true;
    return ReadStatus::kFailed;
  }
  while (!stopped_) {
    Picture picture;
    switch (decoder_.receive(&picture)) {
      case LumaDecoder::Result::kUnsupported:
        error_ = path_ + ": " + decoder_.error();
        failed_ = true;
        return ReadStatus::kFailed;
      case LumaDecoder::Result::kDamaged:
        ++damaged_;
        continue;
      case LumaDecoder::Result::kNone:
        if (drained_) return ReadStatus::kEnd;
        feed();
        continue;
      case LumaDecoder::Result::kPicture:
        break;
    }
    if (picture.pts == AV_NOPTS_VALUE) {
      error_ = path_ +
               ": its pictures have no time stamps; put it into a container that has them, such as "
               "MKV or "
               "MP4";
      failed_ = true;
      return ReadStatus::kFailed;
    }
    frame = Frame{};
    frame.stamp.frame = frames_++;
    frame.stamp.sender_time_s = static_cast<double>(picture.pts) * av_q2d(file_.stream().time_base);
    frame.stamp.receive_time_s = *frame.stamp.sender_time_s;
    frame.interlaced = picture.interlaced;
    frame.width = picture.width;
    frame.height = picture.height;
    frame.luma = picture.luma;
    frame.stride = picture.stride;
    frame.owner = picture.owner;
    return ReadStatus::kOk;
  }
  return ReadStatus::kStopped;
}

}  // namespace

std::unique_ptr<FrameSource> open_video_file(const std::string& path) {
  return std::make_unique<VideoFile>(path);
}

}  // namespace alidade
