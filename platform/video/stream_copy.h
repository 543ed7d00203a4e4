#pragma once
// StreamCopy: stores compressed pictures, or uncompressed grey ones, unchanged in a Matroska file.
// The file's timestamps are arrival times, in milliseconds since the first picture. They continue
// over a reconnection, whatever the sender's clock does (frames.csv has the exact stamps). Clusters
// are closed and flushed after at most a second: a kill loses no more.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "platform/video/av_handles.h"

namespace alidade {

// A picture as its stream carries it: compressed, or uncompressed 8-bit luma.
struct StreamPicture {
  PacketPtr packet;  // AV_PKT_FLAG_KEY: no later picture needs one before this one
  std::shared_ptr<const AVCodecParameters> parameters;  // of the stream
  int width = 0;                                        // px
  int height = 0;                                       // px
  // Decoding can begin here, perhaps with some pictures that are not yet whole.
  bool begins = false;
};

// Parameters of pictures without a libav demuxer: AV_CODEC_ID_MJPEG, or AV_CODEC_ID_RAWVIDEO for
// 8-bit luma without gaps between rows.
[[nodiscard]] std::shared_ptr<const AVCodecParameters> picture_parameters(AVCodecID codec);

// A packet with room for an independently coded picture; null without memory.
[[nodiscard]] PacketPtr make_picture_packet(std::size_t bytes);

class StreamCopy {
 public:
  // path: of the file; add() creates it.
  explicit StreamCopy(std::string path);
  ~StreamCopy();
  StreamCopy(const StreamCopy&) = delete;
  StreamCopy& operator=(const StreamCopy&) = delete;

  // Why this file cannot hold the picture: it has another codec, size or parameter set than the
  // first one. One line; empty: it can.
  [[nodiscard]] std::string fault_of(const StreamPicture& picture) const;

  // Adds a picture without fault; the first call creates the file. receive_time_s: s. On false,
  // *error is one line.
  [[nodiscard]] bool add(const StreamPicture& picture, double receive_time_s, std::string* error);

 private:
  [[nodiscard]] int create(const StreamPicture& first);

  const std::string path_;
  AVFormatContext* format_ = nullptr;
  bool header_written_ = false;
  CodecParametersPtr parameters_;  // of the stream that started the file
  double first_receive_time_s_ = 0;
  std::int64_t last_pts_ = -1;
};

}  // namespace alidade
