#pragma once
// The small image by which a point is found again. It is cut from the image in which the point was
// first seen, and is larger than the compared patch, so that it can be warped (patch_alignment.h).

#include <array>
#include <cstdint>

#include "core/realtime/image/image_view.h"

namespace alidade {

inline constexpr int kReferencePixels = 16;  // in each direction
// px; the point in its reference image: the centre of pixel (8, 8).
inline constexpr double kReferenceCentre = 8.5;

// Row by row, grey levels.
using ReferencePixels = std::array<std::uint8_t, kReferencePixels * kReferencePixels>;

[[nodiscard]] inline ImageView view_of(const ReferencePixels& pixels) {
  return {pixels.data(), kReferencePixels, kReferencePixels, kReferencePixels};
}

}  // namespace alidade
