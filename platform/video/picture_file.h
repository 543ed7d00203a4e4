#pragma once
// One picture in a file: reads what libav decodes (PNG, JPEG, PGM, ...), writes grey PNG.
// Allocates. No shared state.

#include <cstddef>
#include <cstdint>
#include <string>

#include "platform/video/picture.h"

namespace alidade {

// Reads the first picture of the file. On false, *error is one line: path: what is wrong.
[[nodiscard]] bool read_picture_file(const std::string& path, Picture* picture, std::string* error);

// A PNG of 8-bit luma, row v at luma + v * stride. Empty: libav has no PNG encoder, or not for this
// size.
[[nodiscard]] std::string grey_png(const std::uint8_t* luma, int width, int height,
                                   std::ptrdiff_t stride);

}  // namespace alidade
