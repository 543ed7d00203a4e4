#pragma once
// small_jpeg(): shrinks an image for a status page, as a grey JPEG. Each small pixel is the mean of
// factor x factor pixels, factor = ceil(width / max_width). Columns at the right and rows at the
// bottom that do not fill a small pixel are cut off. Allocates; about 1 ms for 1920x1080.

#include <string>

#include "core/realtime/image/image_view.h"

namespace alidade {

// The number of image pixels per small pixel, in each direction.
[[nodiscard]] int shrinking_factor(int width, int max_width);

// Empty: the image is not valid(), is smaller than one small pixel, or the encoder failed.
[[nodiscard]] std::string small_jpeg(const ImageView& image, int max_width);

}  // namespace alidade
