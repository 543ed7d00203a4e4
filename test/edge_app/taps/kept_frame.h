#pragma once
// Frames that have kept their stream's pictures: grey ones of one size, each of which can be decoded
// by itself.

#include <cstdint>
#include <cstring>
#include <memory>
#include <utility>

#include "platform/streams/frame.h"
#include "platform/video/stream_copy.h"

namespace alidade::test {

// The picture's grey is its number.
inline Frame kept_frame(std::int64_t number, double receive_time_s, int width = 32,
                        int height = 16) {
  StreamPicture picture;
  const auto bytes = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  picture.packet = make_picture_packet(bytes);
  std::memset(picture.packet->data, static_cast<int>(number % 256), bytes);
  picture.parameters = picture_parameters(AV_CODEC_ID_RAWVIDEO);
  picture.width = width;
  picture.height = height;
  picture.begins = true;
  Frame frame;
  frame.stamp.frame = number;
  frame.stamp.receive_time_s = receive_time_s;
  frame.width = width;
  frame.height = height;
  frame.coded = std::make_shared<StreamPicture>(std::move(picture));
  return frame;
}

}  // namespace alidade::test
