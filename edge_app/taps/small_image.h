#pragma once
// small_jpeg: an image made small enough for a status page, as a grey JPEG.
//
// Each of its pixels is the mean of factor x factor pixels, factor = ceil(width / max_width); what is left over
// at the right and at the bottom is cut off. Allocates; about a millisecond for 1920x1080.

#include <string>

#include "core/realtime/image/image_view.h"

namespace alidade {

// Pixels of the image to one of the small one, each way.
[[nodiscard]] int shrinking_factor(int width, int max_width);

// Empty: the image is not valid(), or smaller than one pixel of the small one, or the encoder has failed.
[[nodiscard]] std::string small_jpeg(const ImageView& image, int max_width);

}  // namespace alidade
