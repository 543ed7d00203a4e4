#pragma once
// Shimmer: how far points of the pictures move against the common motion of their picture, as
// through haze. No calibration is needed. Between two frames a fraction of a second apart any
// camera that turns, whatever its lens, shifts its points by a smooth function of their place. So a
// polynomial of second order is subtracted from the displacements.
// Haze comes back: what it moves in a short and in a long time is the same. What drifts or lies
// nearer than the rest moves on. Allocates.

#include <string>

#include "core/calibration/linearisation.h"

namespace alidade::internal {

struct Shimmer {
  double rms_px = 0;     // of one observation, each component, within 0.4 s; 0: too few points
  double stated_px = 0;  // median of the observations' sigmas, as scaled so far; 0: likewise
  double grows = 0;      // movement within 0.8 s, relative to that within 0.4 s

  // Comes back (grows is below 1.3), and is more than four times noise_px, the sigma that the
  // tracks stated.
  [[nodiscard]] bool is_haze(double noise_px) const;
};

[[nodiscard]] Shimmer find_shimmer(const AdjustmentData& data);

// The end of a refusal's message, ": haze: ...", if the pictures shimmer as through haze; else
// empty. sigma_ratio: the observations' sigmas in `data` over those that the tracks stated.
[[nodiscard]] std::string haze_text(const AdjustmentData& data, double sigma_ratio);

}  // namespace alidade::internal
