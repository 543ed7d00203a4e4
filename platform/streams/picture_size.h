#pragma once
// Limits on picture size. A size from a file, a configuration or a camera is checked against them
// before memory is allocated.

#include <cstddef>
#include <cstdint>

namespace alidade {

inline constexpr int kMostPictureSide = 16384;  // px; the limit of H.264
inline constexpr std::int64_t kMostFilePixels = 100'000'000;
// For live video without a configured size: 8K.
inline constexpr std::int64_t kMostLivePixels = 36'000'000;

// Largest size of a compressed picture, in bytes: its uncompressed size, but at most 12 MB. No
// camera sends more.
[[nodiscard]] inline std::size_t most_picture_bytes(std::int64_t pixels) {
  constexpr std::int64_t kMost = 12 << 20;
  constexpr std::int64_t kAround = 64 << 10;  // headers and the like
  const std::int64_t raw = 3 * pixels + kAround;
  return static_cast<std::size_t>(raw < kMost ? raw : kMost);
}

}  // namespace alidade
