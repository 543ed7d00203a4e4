#pragma once
// JpegDecoder: decodes the luma plane of JPEG pictures by libjpeg-turbo. The chroma is neither
// transformed nor converted. Pictures without Huffman tables (as in AVI) use the standard ones.
// Cut-off or damaged pictures are detected; excess bytes before the end marker, which some cameras
// write, are not damage. A picture of hundreds of scans is refused: a few forged bytes must not
// occupy the thread for minutes. One thread at a time. Memory is reused (LumaPool).

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "platform/video/luma_pool.h"
#include "platform/video/picture.h"

namespace alidade {

class JpegDecoder {
 public:
  JpegDecoder();

  // Reads only the header. width, height: px. False: not a JPEG, in printing colours (CMYK), or of
  // more than kMostFilePixels; see error().
  [[nodiscard]] bool read_size(std::string_view jpeg, int* width, int* height);

  // False: see error().
  [[nodiscard]] bool decode(std::string_view jpeg, Picture* picture);

  // One line; valid after read_size() or decode() returned false.
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  struct Close {
    void operator()(void* handle) const;
  };
  bool fail(const std::string& error);

  std::unique_ptr<void, Close> handle_;
  LumaPool pool_;
  std::string error_;
};

}  // namespace alidade
