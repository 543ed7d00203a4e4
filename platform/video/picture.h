#pragma once
// A decoded picture's luma plane. Whoever holds `owner` holds the plane.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>

namespace alidade {

struct Picture {
  // libav's AV_NOPTS_VALUE.
  static constexpr std::int64_t kNoPts = std::numeric_limits<std::int64_t>::min();

  int width = 0;                       // px
  int height = 0;                      // px
  const std::uint8_t* luma = nullptr;  // row v at luma + v * stride
  std::ptrdiff_t stride = 0;           // bytes
  std::int64_t pts = kNoPts;           // of the packet it came from
  bool interlaced = false;             // coded as two fields, or of a frame's two fields
  std::shared_ptr<const void> owner;
};

}  // namespace alidade
