#pragma once
// The noise of a picture, from the picture alone: standard deviation of white noise, in grey levels, by the
// second differences of the smoothest quarter of a sample of its pixels (Immerkaer 1996, made robust).
// Where all is textured it is too large. Never below what rounding to whole grey levels makes.
// Pure; no allocation.

#include "core/realtime/image/image_view.h"

namespace alidade {

// scratch: room for as many samples as shall be taken, at least 1.
[[nodiscard]] double image_noise(const ImageView& image, float* scratch, int capacity);

}  // namespace alidade
