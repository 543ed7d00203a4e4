#pragma once
// FrameLandmarks: what the real-time thread saw in one frame, for display.
//   landmark  of OE mode: where the solution expects it, and its residual, found minus expected
//   point     of an uncalibrated camera: where it was found; nothing is expected
// px of the full image (CONVENTIONS.md). The place of an edge is known across the edge only: the
// residual has no part along it. Fixed size and trivially copyable: crosses a queue by value.

#include <array>
#include <cstdint>
#include <type_traits>

#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/oe_mode/oe_mode.h"

namespace alidade {

// The most points that the real-time thread passes on for one frame. Further ones are left out.
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
    kPoints,    // u_px, v_px
    kLandmarks  // all members
  };
  Kind kind = Kind::kNone;
  int count = 0;
  std::array<FramePoint, kMaxFramePoints> found{};  // the first `count` are valid
};
static_assert(std::is_trivially_copyable_v<FrameLandmarks>);

// The part of a residual that was observed, px. An edge's covariance lies along its open direction,
// apart from one part in ten thousand, so cov / trace projects onto that direction.
[[nodiscard]] inline Vector2<double> observed_residual(const OeObservation& found) {
  const double trace = found.covariance.trace();
  if (trace < kUnobservedVariance) return found.residual;
  return found.residual - found.covariance * found.residual / trace;
}

}  // namespace alidade
