#pragma once
// match_frames(): the small shift and the change of light between an image and its prediction from
// an earlier image by the orientations of both. Robust least squares over one pixel in 256:
//   now(u) = gain V(u) / V(w) then(w) + offset,   w = warp(u) + shift + shear r
//   r = 2 u_v / height - 1: -1 in the first row, 1 in the last
//   V(u) = 1 + falloff |u - middle|^2 / (half diagonal)^2
// Shift and shear: errors of orientation and rates that the frames do not share, up to a pixel or
// two if there is texture; 0 in directions without texture. V: lenses are darker at the corners,
// where the scene passes as the camera turns. Moving things are outliers. No allocation.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "core/detection/frame_warp.h"
#include "core/model/linear_algebra.h"
#include "core/realtime/image/image_view.h"

namespace alidade {

// The current image, smoothed (spline_image.h): row by row, in 1/kSmoothUnit grey level.
struct SmoothedView {
  const std::uint16_t* pixels = nullptr;
  int width = 0;
  int height = 0;

  [[nodiscard]] const std::uint16_t* row(int v) const {
    return pixels + static_cast<std::ptrdiff_t>(v) * width;
  }
};

// Variance (grey levels^2) of the difference of two smoothed images of a scene without motion:
//   noise^2 + (shift |gradient|)^2 + (blur |second derivative|)^2
struct DifferenceModel {
  float noise_square = 1;  // grey levels^2
  float shift_square = 0;  // px^2
  float blur_square = 0;   // px^4

  // At pixel u, from three rows of a SmoothedView; u - 1 and u + 1 must exist.
  [[nodiscard]] float variance(const std::uint16_t* above, const std::uint16_t* here,
                               const std::uint16_t* below, int u) const {
    constexpr float kUnitSquare = 1.0F / (36 * 36);
    const auto across = static_cast<float>(here[u + 1] - here[u - 1]);
    const auto down = static_cast<float>(below[u] - above[u]);
    const auto curvature =
        static_cast<float>(here[u + 1] + here[u - 1] + below[u] + above[u] - 4 * here[u]);
    return noise_square + kUnitSquare * (0.25F * shift_square * (across * across + down * down) +
                                         blur_square * curvature * curvature);
  }
};

struct FrameMatch {
  Vector2<double> shift = Vector2<double>::Zero();  // px, in the earlier image
  Vector2<double> shear = Vector2<double>::Zero();  // px
  double gain = 1;
  double offset = 0;   // grey levels
  double falloff = 0;  // of V: light at the corners minus the middle's, as a share of the middle's
  double spread = 0;   // robust spread of the residuals over the model's; 1: as expected
  int samples = 0;

  // r: of the row.
  [[nodiscard]] Vector2<double> shift_at(double r) const { return shift + r * shear; }
  // V(u) / V(w) from squared distances from the middle, over those of the corners.
  [[nodiscard]] double vignetting(double now_square, double then_square) const {
    return (1 + falloff * now_square) / (1 + falloff * then_square);
  }
  [[nodiscard]] double largest_shift() const {
    return std::max(shift_at(-1).norm(), shift_at(1).norm());
  }
};

// r of the middle of a row of pixels.
[[nodiscard]] inline double row_place(int v, int height) { return (2.0 * v + 1) / height - 1; }

// Squared distance from an image's middle, over that of its corners.
class CornerDistance {
 public:
  CornerDistance(int width, int height)
      : middle_u_(0.5F * static_cast<float>(width)),
        middle_v_(0.5F * static_cast<float>(height)),
        scale_(1 / (middle_u_ * middle_u_ + middle_v_ * middle_v_)) {}

  [[nodiscard]] float square(float u, float v) const {
    const float x = u - middle_u_;
    const float y = v - middle_v_;
    return scale_ * (x * x + y * y);
  }

 private:
  float middle_u_, middle_v_, scale_;
};

// warp: corners of columns x rows tiles (frame_warp.h). scratch: at least one element a tile. If no
// sample is in the earlier image, samples is 0, and the rest is not to be used.
[[nodiscard]] FrameMatch match_frames(const SmoothedView& now, const ImageView& then,
                                      const TileCorners& warp, int columns, int rows,
                                      const DifferenceModel& model, std::vector<float>* scratch);

// How much of a tile is inside the earlier image, after a shift (px, in the earlier image).
enum class TileSight { kNone, kPart, kAll };

[[nodiscard]] TileSight tile_sight(const TileCorner* upper, const TileCorner* lower,
                                   const Vector2<double>& shift, int width, int height);

}  // namespace alidade
