#pragma once
// The luma plane of a decoded picture. Holding `owner` keeps the plane alive.

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
  const std::uint8_t* luma = nullptr;  // row v starts at luma + v * stride
  std::ptrdiff_t stride = 0;           // bytes
  std::int64_t pts = kNoPts;           // of the packet it was decoded from
  bool interlaced = false;             // coded as two fields, or as one frame of two fields
  std::shared_ptr<const void> owner;
};

}  // namespace alidade
