#pragma once
// ImageSlot: the place where the capture thread keeps an image that other threads still use. The
// last thread to use the image returns the slot. 0 to kImageSlots - 1, or kNoImageSlot.

#include <cstdint>

namespace alidade {

using ImageSlot = std::int32_t;
inline constexpr ImageSlot kNoImageSlot = -1;
inline constexpr ImageSlot kImageSlots = 32;

}  // namespace alidade
