#pragma once
// Images smoothed by the cubic B-spline (sampling.h). The blur is nearly the same at pixel centres
// and between them. So two images can be compared at any fraction of a pixel without interpolation
// errors, to 0.001 px. The variance of white noise falls to 0.46 to 0.5 of itself in each
// direction.
//   smooth_image   at all pixel centres: weights (1 4 1) / 6 both ways, exact, in 1/36 grey level
//   spline_value   anywhere, with weights for the nearest 1/64 px

#include <array>
#include <cstdint>

#include "core/realtime/image/byte_vector.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/image/sampling.h"

namespace alidade {

inline constexpr int kSmoothUnit = 36;  // of a grey level
// px; distance from the edges at which spline_value() has all its pixels.
inline constexpr float kSplineMargin = 2;

namespace internal {

inline constexpr int kSplineSteps = 64;  // a pixel
extern const std::array<std::array<float, 4>, kSplineSteps + 1> kSplineWeights;

}  // namespace internal

// image: valid, at least 2 px wide. out: width * height values, row by row. The first and last row
// are smoothed along the row only, the first and last column not at all.
void smooth_image(const ImageView& image, std::uint16_t* out);

// In grey levels. u, v: at least kSplineMargin from every edge.
[[nodiscard]] inline float spline_value(const ImageView& image, float u, float v) {
  const float x = u - 1.5F;
  const float y = v - 1.5F;
  const int column = static_cast<int>(x);
  const int row = static_cast<int>(y);
  // t is not negative; std::lround() would be a call for each sample.
  const auto step = [](float t) {
    constexpr float kHalf = 0.5F;
    return static_cast<std::size_t>(t * static_cast<float>(internal::kSplineSteps) + kHalf);
  };
  const auto& across = internal::kSplineWeights[step(x - static_cast<float>(column))];
  const auto& down = internal::kSplineWeights[step(y - static_cast<float>(row))];
  const std::uint8_t* first = image.row(row) + column;
  FloatVector lines = down[0] * load_four(first);
  lines += down[1] * load_four(first + image.stride);
  lines += down[2] * load_four(first + 2 * image.stride);
  lines += down[3] * load_four(first + 3 * image.stride);
  return sum(load_four(across.data()) * lines);
}

}  // namespace alidade
