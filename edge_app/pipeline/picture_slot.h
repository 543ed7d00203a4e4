#pragma once
// PictureSlot: where the capture thread keeps a picture that others still look at. Whoever had it last gives the
// slot back.

#include <cstdint>

namespace alidade {

using PictureSlot = std::int32_t;
inline constexpr PictureSlot kNoPicture = -1;
inline constexpr PictureSlot kPictureSlots = 32;

}  // namespace alidade
