#pragma once
// small_jpeg(): shrinks an image for a status page, as a JPEG, in colour if the image has it. Each
// small pixel is the mean of factor x factor pixels, factor = ceil(width / max_width). Columns at
// the right and rows at the bottom that do not fill a small pixel are cut off. Allocates; some
// milliseconds for 1920x1080.

#include <cstddef>
#include <cstdint>
#include <string>

#include "core/realtime/image/image_view.h"
#include "platform/streams/frame.h"

namespace alidade {

// Where an image's colour is. Both empty: it is grey.
struct ImageColour {
  ChromaPlanes chroma;
  // In place of it: the whole picture as a JPEG.
  const std::uint8_t* jpeg = nullptr;
  std::size_t jpeg_bytes = 0;
};

// What the frame has of it; lives as long as the frame.
[[nodiscard]] ImageColour colour_of(const Frame& frame);

// The number of image pixels per small pixel, in each direction.
[[nodiscard]] int shrinking_factor(int width, int max_width);

// Empty: the image is not valid(), is smaller than one small pixel, or the encoder failed. With
// colour.jpeg the small image is that picture, scaled by the decoder to at most max_width.
[[nodiscard]] std::string small_jpeg(const ImageView& image, int max_width,
                                     const ImageColour& colour = {});

}  // namespace alidade
