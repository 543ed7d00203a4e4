#pragma once
// ImageSlot: the place where the capture thread keeps an image that others still look at. The last
// one to use the image returns the slot.

#include <cstdint>

namespace alidade {

using ImageSlot = std::int32_t;
inline constexpr ImageSlot kNoImageSlot = -1;
inline constexpr ImageSlot kImageSlots = 32;

}  // namespace alidade
