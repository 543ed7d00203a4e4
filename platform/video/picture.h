#pragma once
// The planes of a decoded picture. Holding `owner` keeps them alive.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <utility>

#include "platform/streams/frame.h"

namespace alidade {

struct Picture {
  // libav's AV_NOPTS_VALUE.
  static constexpr std::int64_t kNoPts = std::numeric_limits<std::int64_t>::min();

  int width = 0;                       // px
  int height = 0;                      // px
  const std::uint8_t* luma = nullptr;  // row v starts at luma + v * stride
  std::ptrdiff_t stride = 0;           // bytes
  ChromaPlanes chroma;                 // as Frame::chroma
  std::int64_t pts = kNoPts;           // of the packet it was decoded from
  bool interlaced = false;             // coded as two fields, or as one frame of two fields
  std::shared_ptr<const void> owner;
};

// The picture becomes the frame's, with its size.
inline void set_picture(Picture picture, Frame* frame) {
  frame->width = picture.width;
  frame->height = picture.height;
  frame->luma = picture.luma;
  frame->stride = picture.stride;
  frame->chroma = picture.chroma;
  frame->interlaced = picture.interlaced;
  frame->owner = std::move(picture.owner);
}

}  // namespace alidade
