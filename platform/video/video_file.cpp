#include "platform/video/video_file.h"

#include <atomic>
#include <utility>

#include "platform/video/luma_decoder.h"

namespace alidade {
namespace {

class VideoFile : public FrameSource {
 public:
  explicit VideoFile(std::string path) : path_(std::move(path)) { silence_av_log(); }
  ~VideoFile() override { avformat_close_input(&file_); }
  VideoFile(const VideoFile&) = delete;
  VideoFile& operator=(const VideoFile&) = delete;

  ReadStatus read(Frame& frame, double timeout_s) override;
  void stop() override { stopped_ = true; }
  std::string error() const override { return path_ + ": " + error_; }
  std::string name() const override { return path_; }
  FrameSourceCounters counters() const override { return {damaged_, 0}; }

 private:
  [[nodiscard]] bool open();
  void feed();

  std::string path_;
  std::string error_;
  AVFormatContext* file_ = nullptr;
  int stream_ = 0;
  LumaDecoder decoder_;
  std::int64_t frames_ = 0;
  std::int64_t damaged_ = 0;
  bool drained_ = false;
  bool failed_ = false;
  std::atomic<bool> stopped_{false};
};

bool VideoFile::open() {
  int code = avformat_open_input(&file_, path_.c_str(), nullptr, nullptr);
  if (code >= 0) code = avformat_find_stream_info(file_, nullptr);
  if (code < 0) {
    error_ = av_error_text(code) + "; expected a video file";
    return false;
  }
  stream_ = av_find_best_stream(file_, AVMEDIA_TYPE_VIDEO, -1, -1, nullptr, 0);
  if (stream_ < 0) {
    error_ = "there is no video in it";
    return false;
  }
  if (!decoder_.open(*file_->streams[stream_]->codecpar, false)) {
    error_ = decoder_.error();
    return false;
  }
  return true;
}

// One more packet for the decoder; at the end of the file, or where it breaks off, that no more will come.
void VideoFile::feed() {
  const PacketPtr packet(av_packet_alloc());
  int code = 0;
  do {
    av_packet_unref(packet.get());
    code = av_read_frame(file_, packet.get());
  } while (code >= 0 && packet->stream_index != stream_);
  if (code < 0) {
    drained_ = true;
    (void)decoder_.send(nullptr);
  } else if (!decoder_.send(packet.get())) {
    ++damaged_;
  }
}

ReadStatus VideoFile::read(Frame& frame, double /*timeout_s*/) {
  if (failed_) return ReadStatus::kFailed;
  if (file_ == nullptr && !open()) {
    failed_ = true;
    return ReadStatus::kFailed;
  }
  while (!stopped_) {
    Picture picture;
    switch (decoder_.receive(&picture)) {
      case LumaDecoder::Result::kUnsupported:
        error_ = decoder_.error();
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
      error_ =
          "its pictures have no time stamps; put it into a container that has them, such as MKV or "
          "MP4";
      failed_ = true;
      return ReadStatus::kFailed;
    }
    frame = Frame{};
    frame.stamp.frame = frames_++;
    frame.stamp.sender_time_s =
        static_cast<double>(picture.pts) * av_q2d(file_->streams[stream_]->time_base);
    frame.stamp.receive_time_s = *frame.stamp.sender_time_s;
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
