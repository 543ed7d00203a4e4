#pragma once
// JpegDecoder: a JPEG picture to its luma plane, by libjpeg-turbo. The chroma is neither transformed
// nor converted. Pictures without Huffman tables (as in AVI) are decoded with the standard ones.
// A picture that is cut off or damaged is told from a whole one; excess bytes before its end marker,
// which some cameras write, are no damage. A picture of hundreds of scans is refused: a few forged bytes
// must not hold the thread for minutes. One thread at a time; the memory of pictures is used again (LumaPool).

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

  // Of the header alone. False: no JPEG, or larger than any camera's picture.
  [[nodiscard]] bool read_size(std::string_view jpeg, int* width, int* height);

  // False: see error().
  [[nodiscard]] bool decode(std::string_view jpeg, Picture* picture);

  // One line; valid after read_size() or decode() said false.
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
