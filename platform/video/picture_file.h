#pragma once
// One picture in a file of its own: read from what libav decodes (PNG, JPEG, PGM, ...), written as a grey PNG. Allocates. No shared state.

#include <cstddef>
#include <cstdint>
#include <string>

#include "platform/video/picture.h"

namespace alidade {

// The first picture of the file. False leaves one line in *error: path: what is wrong.
[[nodiscard]] bool read_picture_file(const std::string& path, Picture* picture, std::string* error);

// The bytes of a PNG of 8-bit luma, row v at luma + v * stride; empty: libav has no encoder for it, or not this size.
[[nodiscard]] std::string grey_png(const std::uint8_t* luma, int width, int height,
                                   std::ptrdiff_t stride);

}  // namespace alidade
