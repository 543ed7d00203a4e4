#pragma once
// ImageSlot: where the capture thread keeps an image that others still look at. Whoever had it last gives the
// slot back.

#include <cstdint>

namespace alidade {

using ImageSlot = std::int32_t;
inline constexpr ImageSlot kNoImageSlot = -1;
inline constexpr ImageSlot kImageSlots = 32;

}  // namespace alidade
