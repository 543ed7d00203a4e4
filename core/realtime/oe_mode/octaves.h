#pragma once
// Octaves: which octaves of the image pyramid OE mode uses, and what can be seen in each. Pixels of
// octave l are 2^l as wide as the image's. Landmarks of octaves below first_coarse are fine:
// aligned one by one. Those from first_coarse on are coarse: aligned together, in pan and tilt.
// Plain value; no allocation.

#include <algorithm>
#include <cmath>

#include "core/model/lens/camera.h"
#include "core/model/linear_algebra.h"
#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/image/pyramid.h"

namespace alidade {

struct OctaveOptions {
  int first_coarse = 2;      // octave, 1 to Pyramid::kMaxOctaves - 1
  int least_height_px = 32;  // of the coarsest octave: enough for several patches
  double least_noise = 0.3;  // grey levels, > 0; of rounding, which averaging does not reduce
  double least_contrast =
      1.5;  // times an octave's noise, > 0.5, as noise alone shows 0.5: see prepare()

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const {
    const char* problem = nullptr;
    if (!(least_contrast > 0.5)) problem = "least_contrast must be above 0.5";
    if (!(least_noise > 0)) problem = "least_noise must be positive";
    if (least_height_px < kPatchSize) problem = "least_height_px must hold a patch";
    if (first_coarse < 1 || first_coarse >= Pyramid::kMaxOctaves)
      problem = "first_coarse must be 1 to 7";
    if (error != nullptr && problem != nullptr) *error = problem;
    return problem == nullptr;
  }
};

class Octaves {
 public:
  explicit Octaves(const OctaveOptions& options) : options_(options) {}

  // height_px: of the images.
  void reset(int height_px) {
    count_ = 1;
    while (count_ < Pyramid::kMaxOctaves && height_px >> count_ >= options_.least_height_px) {
      ++count_;
    }
  }
  // sigma: grey levels, of the image's own pixels.
  void set_noise(double sigma) { noise_sigma_ = sigma; }

  [[nodiscard]] int count() const { return count_; }
  [[nodiscard]] int first_coarse() const { return options_.first_coarse; }
  [[nodiscard]] bool is_coarse(int octave) const { return octave >= options_.first_coarse; }
  [[nodiscard]] double noise_sigma() const { return noise_sigma_; }

  // Grey levels, of one octave's pixels: averaging reduces it, down to that of rounding.
  [[nodiscard]] double noise(int octave) const {
    return std::max(std::ldexp(noise_sigma_, -octave), options_.least_noise);
  }
  // Grey levels per pixel, for prepare(). A patch with less contrast has too small a covariance.
  [[nodiscard]] double least_contrast(int octave) const {
    return options_.least_contrast * noise(octave);
  }

 private:
  OctaveOptions options_;
  int count_ = 1;
  double noise_sigma_ = 0;
};

// True if a patch of this octave at pixel u is completely in the image.
[[nodiscard]] inline bool holds_patch(const Camera<double>& camera, const Vector2<double>& u,
                                      int octave) {
  constexpr double kMargin_px = 2.5;  // px of the octave; for the taps around the outermost points
  const double border_px = (0.5 * kPatchSize + kMargin_px) * (1 << octave);
  return u.x() >= border_px && u.y() >= border_px && u.x() <= camera.width - border_px &&
         u.y() <= camera.height - border_px;
}

}  // namespace alidade
