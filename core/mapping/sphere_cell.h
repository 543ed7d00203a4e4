#pragma once
// Cells of about equal size on the unit sphere: rings of constant latitude, each divided into as
// many cells as it has room for. Landmarks with scales in an octave [2^o, 2^(o+1)) rad have cells
// with a side of `scales` times 2^o rad. Pure.

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/model/linear_algebra.h"
#include "core/model/trigonometry.h"

namespace alidade {

// The cell's number; two directions have the same number only if octave and cell are equal. d: unit
// length. scale_rad: 2^-60 to 1.
[[nodiscard]] inline std::uint64_t sphere_cell(const Vector3<double>& d, double scale_rad,
                                               double scales) {
  const int octave = std::clamp(std::ilogb(scale_rad), -60, 0);
  // No finer than the number has room for.
  const double side = std::clamp(scales * std::ldexp(1.0, octave), 1e-6, kPi);
  const double from_pole = std::acos(std::clamp(d.z(), -1.0, 1.0));
  const double ring = std::floor(from_pole / side);
  const double middle = std::min(kPi, (ring + 0.5) * side);
  const double cells = std::max(1.0, std::floor(2 * kPi * std::sin(middle) / side));
  const double turn = (std::atan2(d.y(), d.x()) + kPi) / (2 * kPi);
  const double cell = std::min(cells - 1, std::floor(turn * cells));
  return (static_cast<std::uint64_t>(-octave) << 56U) | (static_cast<std::uint64_t>(ring) << 28U) |
         static_cast<std::uint64_t>(cell);
}

}  // namespace alidade
