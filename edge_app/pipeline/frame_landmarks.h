#pragma once
// FrameLandmarks: what the real-time thread saw in one frame, for people to look at.
//
//   landmark   of OE mode: where the solution expects it, and its residual: found minus expected
//   point      of an uncalibrated camera: where it was found; nothing is expected
//
// px of the full picture (CONVENTIONS.md). On an edge a landmark is found across it only: its residual has no
// part along it. Fixed size and trivially copyable: crosses a queue by value.

#include <array>
#include <cstdint>
#include <type_traits>

#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/oe_mode/oe_mode.h"

namespace alidade {

struct SeenLandmark {
  float u_px = 0;
  float v_px = 0;
  float du_px = 0;
  float dv_px = 0;
  bool used = false;  // false: an outlier
};

struct FrameLandmarks {
  static constexpr int kMaxSeen = 256;

  enum class Kind : std::uint8_t {
    kNone,      // nothing was looked for, or nothing held
    kPoints,    // u and v only
    kLandmarks  // all
  };
  Kind kind = Kind::kNone;
  int count = 0;
  std::array<SeenLandmark, kMaxSeen> seen{};  // the first `count`
};
static_assert(std::is_trivially_copyable_v<FrameLandmarks>);

// px, the part of a residual that was observed. An edge's covariance is that of its open direction but for a
// ten-thousandth: cov / trace projects on that direction.
[[nodiscard]] inline Vector2<double> observed_residual(const OeObservation& seen) {
  const double trace = seen.covariance.trace();
  if (trace < kUnobservedVariance) return seen.residual;
  return seen.residual - seen.covariance * seen.residual / trace;
}

}  // namespace alidade
