#include "platform/video/recording_frame_source.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <utility>
#include <vector>

#include "platform/storage/playback.h"
#include "platform/storage/recording.h"
#include "platform/video/av_file.h"
#include "platform/video/luma_decoder.h"

namespace alidade {
namespace {

struct ImageType {
  const char* extension;
  AVCodecID codec;
};

constexpr std::array<ImageType, 3> kImageTypes = {
    {{".png", AV_CODEC_ID_PNG}, {".jpg", AV_CODEC_ID_MJPEG}, {".pgm", AV_CODEC_ID_PGM}}};

class FramesOnDisk : public RecordingFrameSource {
 public:
  explicit FramesOnDisk(const RecordingFrameSourceOptions& options)
      : options_(options), playback_(options.directory, options.realtime) {
    silence_av_log();
  }

  ReadStatus read(Frame& frame, double timeout_s) override;
  void stop() override { playback_.stop(); }
  std::string error() const override { return error_; }
  std::string name() const override { return options_.directory; }
  std::int64_t damaged_frames() const override { return damaged_; }
  std::int64_t missing_frames() const override {
    return static_cast<std::int64_t>(stamps_.size()) - static_cast<std::int64_t>(row_);
  }
  std::vector<std::string> remarks() const override;

 private:
  using NextFrame = ReadStatus (FramesOnDisk::*)(Frame* frame);

  ReadStatus load();
  ReadStatus open_video(const std::string& path);
  ReadStatus next_stamp(Frame* frame);
  ReadStatus next_in_video(Frame* frame);
  ReadStatus next_image(Frame* frame);
  bool feed_decoder();
  [[nodiscard]] bool rows_are_in_order();
  ReadStatus finish(const Picture& picture, const FrameStamp& stamp, Frame* frame);
  ReadStatus fail(const std::string& error) {
    error_ = error;
    return ReadStatus::kFailed;
  }

  RecordingFrameSourceOptions options_;
  Playback playback_;
  ReadStatus status_ = ReadStatus::kOk;  // how it ended, once it has
  std::string error_;
  bool loaded_ = false;
  RecordingInfo info_;
  std::vector<FrameStamp> stamps_;
  NextFrame next_frame_ = &FramesOnDisk::next_stamp;
  std::size_t row_ = 0;         // first row of stamps_ that is neither delivered nor skipped
  std::optional<Frame> ready_;  // decoded, but not due yet
  std::int64_t damaged_ = 0;
  LumaDecoder decoder_;

  // video.mkv
  AvFile video_;
  bool drained_ = false;
  std::int64_t packets_ = 0;
  std::set<std::int64_t> in_decoder_;  // timestamps of packets whose picture has not come out yet
  std::int64_t last_pts_ = AV_NOPTS_VALUE;
  bool has_b_frames_ = false;      // a packet came after one whose picture was taken later
  bool order_is_checked_ = false;  // checked, and right

  bool interlaced_ = false;  // one of the pictures is coded as two fields

  // frames/
  AVCodecID image_codec_ = AV_CODEC_ID_NONE;
};

ReadStatus FramesOnDisk::load() {
  const std::string& directory = options_.directory;
  if (!read_recording_info(directory, &info_, &error_) ||
      !read_frames_csv(directory, &stamps_, &error_)) {
    return ReadStatus::kFailed;
  }
  if (!options_.decode) {
    return ReadStatus::kOk;
  }
  std::error_code ignored;
  if (std::filesystem::exists(directory + "/video.mkv", ignored)) {
    next_frame_ = &FramesOnDisk::next_in_video;
    return open_video(directory + "/video.mkv");
  }
  if (std::filesystem::is_directory(directory + "/frames", ignored)) {
    next_frame_ = &FramesOnDisk::next_image;
    return ReadStatus::kOk;
  }
  if (std::filesystem::exists(directory + "/tracks.csv", ignored)) {
    return ReadStatus::kOk;
  }
  return fail(directory + ": no pictures; a recording holds video.mkv, frames/ or tracks.csv");
}

ReadStatus FramesOnDisk::open_video(const std::string& path) {
  if (!video_.open(path, &error_)) {
    return ReadStatus::kFailed;
  }
  if (!decoder_.open(*video_.stream().codecpar, false)) {
    return fail(path + ": " + decoder_.error());
  }
  return ReadStatus::kOk;
}

ReadStatus FramesOnDisk::next_stamp(Frame* frame) {
  if (row_ == stamps_.size()) {
    return ReadStatus::kEnd;
  }
  *frame = Frame{};
  frame->stamp = stamps_[row_++];
  frame->width = info_.width;
  frame->height = info_.height;
  return ReadStatus::kOk;
}

// Feeds the decoder one more packet, or at the end of the file the end. False: it had the end
// already.
bool FramesOnDisk::feed_decoder() {
  if (drained_) {
    return false;
  }
  const PacketPtr packet(av_packet_alloc());
  if (!video_.read(packet.get())) {
    drained_ = true;
    (void)decoder_.send(nullptr);
    return true;
  }
  if (packet->pts == AV_NOPTS_VALUE) {
    packet->pts = packets_;
  }
  ++packets_;
  // For the first packet last_pts_ is the least value.
  has_b_frames_ = has_b_frames_ || packet->pts < last_pts_;
  last_pts_ = packet->pts;
  in_decoder_.insert(packet->pts);
  (void)decoder_.send(packet.get());  // failure shows when the next picture comes
  return true;
}

// For a video with B-frames. Rows written in order of arrival do not belong to the pictures in
// order of capture. Their sender_time_s then steps back, by less than at a restart of the sender's
// clock.
bool FramesOnDisk::rows_are_in_order() {
  constexpr double kMostReordering_s = 1;
  const auto steps_back = [](const FrameStamp& a, const FrameStamp& b) {
    if (!a.sender_time_s || !b.sender_time_s) return false;
    const double step_s = *b.sender_time_s - *a.sender_time_s;
    return step_s < 0 && step_s > -kMostReordering_s;
  };
  order_is_checked_ = order_is_checked_ || std::adjacent_find(stamps_.begin(), stamps_.end(),
                                                              steps_back) == stamps_.end();
  if (order_is_checked_) return true;
  error_ =
      options_.directory +
      "/frames.csv: sender_time_s steps back, and video.mkv has B-frames, so its rows are in the "
      "order of packets, not of pictures; sort them by sender_time_s, or record without B-frames";
  return false;
}

std::vector<std::string> FramesOnDisk::remarks() const {
  std::vector<std::string> remarks;
  if (has_b_frames_) {
    remarks.push_back(options_.directory +
                      "/video.mkv has B-frames: row k of frames.csv must belong to the k-th "
                      "picture in order of capture; if rows were written in the order of packets, "
                      "stamps are wrong by some frames: record without B-frames");
  }
  if (interlaced_) remarks.push_back(options_.directory + ": " + kInterlaced);
  return remarks;
}

// A decoder returns pictures in the order of their timestamps. So a picture's index is the number
// of packets with an earlier timestamp, even if some gave no picture.
ReadStatus FramesOnDisk::next_in_video(Frame* frame) {
  for (;;) {
    Picture picture;
    const LumaDecoder::Result result = decoder_.receive(&picture);
    if (result == LumaDecoder::Result::kUnsupported) {
      return fail(options_.directory + "/video.mkv: " + decoder_.error());
    }
    if (result == LumaDecoder::Result::kNone && !feed_decoder()) {
      damaged_ += static_cast<std::int64_t>(in_decoder_.size());
      row_ = std::min(row_ + in_decoder_.size(), stamps_.size());
      return ReadStatus::kEnd;
    }
    if (has_b_frames_ && !rows_are_in_order()) return ReadStatus::kFailed;
    if (result == LumaDecoder::Result::kPicture) {
      const auto end = in_decoder_.upper_bound(picture.pts);
      const auto places = static_cast<std::size_t>(std::distance(in_decoder_.begin(), end));
      in_decoder_.erase(in_decoder_.begin(), end);
      row_ += places;
      damaged_ += static_cast<std::int64_t>(places) - 1;
      if (row_ > stamps_.size()) {
        row_ = stamps_.size();
        return ReadStatus::kEnd;
      }
      return finish(picture, stamps_[row_ - 1], frame);
    }
  }
}

ReadStatus FramesOnDisk::next_image(Frame* frame) {
  while (row_ < stamps_.size()) {
    const FrameStamp& stamp = stamps_[row_++];
    char number[24];
    std::snprintf(number, sizeof number, "%06lld", static_cast<long long>(stamp.frame));
    const std::string path = options_.directory + "/frames/" + number;
    std::ifstream file;
    const auto type = std::find_if(kImageTypes.begin(), kImageTypes.end(), [&](const auto& t) {
      file.open(path + t.extension, std::ios::binary);
      return file.is_open();
    });
    if (type == kImageTypes.end()) {
      return fail(
          path +
          ": frames.csv has a row for this picture, but there is no .png, .jpg or .pgm of it");
    }
    if (type->codec != image_codec_) {
      const std::shared_ptr<AVCodecParameters> parameters(avcodec_parameters_alloc(), AvDeleter());
      parameters->codec_type = AVMEDIA_TYPE_VIDEO;
      parameters->codec_id = type->codec;
      // Independently coded pictures: none is held back.
      if (!decoder_.open(*parameters, false)) {
        return fail(path + type->extension + ": " + decoder_.error());
      }
      image_codec_ = type->codec;
    }
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    const PacketPtr packet(av_packet_alloc());
    Picture picture;
    LumaDecoder::Result result = LumaDecoder::Result::kNone;
    if (av_new_packet(packet.get(), static_cast<int>(bytes.size())) == 0) {
      std::copy(bytes.begin(), bytes.end(), packet->data);
      // Without this flag the PNG decoder adds each picture to the one before.
      packet->flags |= AV_PKT_FLAG_KEY;
      if (!bytes.empty() && decoder_.send(packet.get())) {
        result = decoder_.receive(&picture);
      }
    }
    if (result == LumaDecoder::Result::kUnsupported) {
      return fail(path + type->extension + ": " + decoder_.error());
    }
    if (result == LumaDecoder::Result::kPicture) {
      return finish(picture, stamp, frame);
    }
    ++damaged_;
  }
  return ReadStatus::kEnd;
}

ReadStatus FramesOnDisk::finish(const Picture& picture, const FrameStamp& stamp, Frame* frame) {
  if (picture.width != info_.width || picture.height != info_.height) {
    return fail(options_.directory + "/recording.yaml: the size is given as " +
                std::to_string(info_.width) + "x" + std::to_string(info_.height) + ", frame " +
                std::to_string(stamp.frame) + " has " + std::to_string(picture.width) + "x" +
                std::to_string(picture.height));
  }
  *frame = Frame{};
  frame->stamp = stamp;
  frame->width = picture.width;
  frame->height = picture.height;
  frame->luma = picture.luma;
  frame->stride = picture.stride;
  frame->interlaced = picture.interlaced;
  interlaced_ = interlaced_ || picture.interlaced;
  frame->owner = picture.owner;
  return ReadStatus::kOk;
}

ReadStatus FramesOnDisk::read(Frame& frame, double timeout_s) {
  if (playback_.stopped()) {
    return ReadStatus::kStopped;
  }
  if (!loaded_) {
    loaded_ = true;
    status_ = load();
  }
  if (status_ == ReadStatus::kOk && !ready_) {
    ready_.emplace();
    status_ = (this->*next_frame_)(&*ready_);
  }
  if (status_ != ReadStatus::kOk) {
    return status_;
  }
  const ReadStatus due = playback_.wait_until_due(ready_->stamp.receive_time_s, timeout_s);
  if (due == ReadStatus::kOk) {
    frame = std::move(*ready_);
    ready_.reset();
  }
  return due;
}

}  // namespace

std::unique_ptr<RecordingFrameSource> open_recorded_frames(
    const RecordingFrameSourceOptions& options) {
  return std::make_unique<FramesOnDisk>(options);
}

}  // namespace alidade
