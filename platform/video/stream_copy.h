#pragma once
// StreamCopy: stores compressed pictures, or uncompressed grey ones, unchanged in a Matroska file.
// Part of the sources that copy. The file's timestamps are arrival times, in milliseconds since the
// first picture. They continue over a reconnection, whatever the sender's clock does (frames.csv
// has the exact stamps). Clusters are closed and flushed after at most a second: a kill loses no
// more.

#include <cstddef>
#include <string>

#include "platform/video/av_handles.h"

namespace alidade {

// Parameters of pictures without a libav demuxer: AV_CODEC_ID_MJPEG, or AV_CODEC_ID_RAWVIDEO for
// 8-bit luma without gaps between rows.
[[nodiscard]] CodecParametersPtr picture_parameters(AVCodecID codec);

// A packet with room for an independently coded picture; null without memory.
[[nodiscard]] PacketPtr make_picture_packet(std::size_t bytes);

class StreamCopy {
 public:
  StreamCopy() = default;
  ~StreamCopy();
  StreamCopy(const StreamCopy&) = delete;
  StreamCopy& operator=(const StreamCopy&) = delete;

  // Adds a picture; the first call creates the file `path`. width, height: px; receive_time_s: s. A
  // picture with another codec, size or parameter set than the first cannot be added. On false,
  // *error is one line.
  [[nodiscard]] bool add(const std::string& path, const AVCodecParameters& parameters, int width,
                         int height, const AVPacket& picture, double receive_time_s,
                         std::string* error);
  // True if the last picture was not added because of another codec, size or parameter set; the
  // file can still go on.
  [[nodiscard]] bool is_another_stream() const { return another_; }

 private:
  [[nodiscard]] int create(const std::string& path, const AVCodecParameters& parameters, int width,
                           int height, const AVPacket& first);

  AVFormatContext* format_ = nullptr;
  bool header_written_ = false;
  bool another_ = false;
  CodecParametersPtr parameters_;  // of the connection that started the file
  double first_receive_time_s_ = 0;
  std::int64_t last_pts_ = -1;
};

}  // namespace alidade
