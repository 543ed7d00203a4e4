#pragma once
// The largest picture that anything here is made for. What a file, a configuration or a camera says is held against it before
// memory is taken.

#include <cstddef>
#include <cstdint>

namespace alidade {

inline constexpr int kMostPictureSide = 16384;  // px, as H.264's
inline constexpr std::int64_t kMostFilePixels = 100'000'000;
// Of live video whose size is not configured: 8K.
inline constexpr std::int64_t kMostLivePixels = 36'000'000;

// Compressed: more is no picture of so many pixels, nor of any camera.
[[nodiscard]] inline std::size_t most_picture_bytes(std::int64_t pixels) {
  constexpr std::int64_t kMost = 12 << 20;
  constexpr std::int64_t kAround = 64 << 10;  // headers and the like
  const std::int64_t raw = 3 * pixels + kAround;
  return static_cast<std::size_t>(raw < kMost ? raw : kMost);
}

}  // namespace alidade
