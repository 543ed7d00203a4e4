#pragma once
// FrameLandmarks: what the real-time thread saw in one frame, for people to look at.
//
//   landmark   of OE mode: where the solution expects it, and its residual: found minus expected
//   point      of an uncalibrated camera: where it was found; nothing is expected
//
// px of the full image (CONVENTIONS.md). On an edge a landmark is found across it only: its residual has no
// part along it. Fixed size and trivially copyable: crosses a queue by value.

#include <array>
#include <cstdint>
#include <type_traits>

#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/oe_mode/oe_mode.h"

namespace alidade {

// Of one frame, that the real-time thread hands on; what is found beyond that is left out.
inline constexpr int kMaxFramePoints = 256;

struct FramePoint {
  float u_px = 0;
  float v_px = 0;
  float du_px = 0;
  float dv_px = 0;
  bool inlier = false;
};

struct FrameLandmarks {
  enum class Kind : std::uint8_t {
    kNone,      // nothing was looked for, or nothing held
    kPoints,    // u and v only
    kLandmarks  // all
  };
  Kind kind = Kind::kNone;
  int count = 0;
  std::array<FramePoint, kMaxFramePoints> found{};  // the first `count`
};
static_assert(std::is_trivially_copyable_v<FrameLandmarks>);

// px, the part of a residual that was observed. An edge's covariance is that of its open direction but for a
// ten-thousandth: cov / trace projects on that direction.
[[nodiscard]] inline Vector2<double> observed_residual(const OeObservation& found) {
  const double trace = found.covariance.trace();
  if (trace < kUnobservedVariance) return found.residual;
  return found.residual - found.covariance * found.residual / trace;
}

}  // namespace alidade
