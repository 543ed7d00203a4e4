#pragma once
// StreamCopy: stores compressed pictures, or uncompressed grey ones, in a Matroska file as they are.
// Part of the sources that copy.
//
// The file's timestamps are arrival times, milliseconds since the first picture: they go on over a
// reconnection, whatever the sender's clock does (frames.csv holds the exact stamps).
// Clusters are closed and flushed after a second at most: a kill loses no more.

#include <cstddef>
#include <string>

#include "platform/video/av_handles.h"

namespace alidade {

// Of pictures that no libav demuxer describes: AV_CODEC_ID_MJPEG, or AV_CODEC_ID_RAWVIDEO for 8-bit luma
// without gaps between its rows.
[[nodiscard]] CodecParametersPtr picture_parameters(AVCodecID codec);

// Room for such a picture, each of which can be decoded by itself; null without memory.
[[nodiscard]] PacketPtr make_picture_packet(std::size_t bytes);

class StreamCopy {
 public:
  StreamCopy() = default;
  ~StreamCopy();
  StreamCopy(const StreamCopy&) = delete;
  StreamCopy& operator=(const StreamCopy&) = delete;

  // Adds a picture, the first time making the file. A connection whose codec or picture size differs
  // from the first one's cannot be continued. False: *error is one line.
  [[nodiscard]] bool add(const std::string& path, const AVCodecParameters& parameters, int width,
                         int height, const AVPacket& picture, double receive_time_s,
                         std::string* error);
  // Whether the last picture was not added because of that; the file can still go on.
  [[nodiscard]] bool is_another_stream() const { return another_; }

 private:
  [[nodiscard]] int create(const std::string& path, const AVCodecParameters& parameters, int width,
                           int height, const AVPacket& first);

  AVFormatContext* format_ = nullptr;
  bool header_written_ = false;
  bool another_ = false;
  CodecParametersPtr parameters_;  // of the connection that began the file
  double first_receive_time_s_ = 0;
  std::int64_t last_pts_ = -1;
};

}  // namespace alidade
