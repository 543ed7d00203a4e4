#pragma once
// What a frame keeps of its stream (Frame::coded), for those who need not know libav.

#include <cstddef>
#include <cstdint>
#include <utility>

#include "platform/streams/frame.h"

namespace alidade {

// Bytes of Frame::coded; 0 without.
[[nodiscard]] std::size_t coded_bytes(const Frame& frame);

// Frame::coded, if it is a JPEG picture: its bytes, which live as long as the frame. Else null.
[[nodiscard]] std::pair<const std::uint8_t*, std::size_t> coded_jpeg(const Frame& frame);

}  // namespace alidade
