#include "core/detection/spline_image.h"

namespace alidade {
namespace {

using SplineWeights = std::array<std::array<float, 4>, internal::kSplineSteps + 1>;

SplineWeights make_spline_weights() {
  SplineWeights all{};
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Taps<4> taps =
        CubicBSpline::taps(static_cast<float>(i) / static_cast<float>(internal::kSplineSteps));
    for (std::size_t k = 0; k < 4; ++k) all[i][k] = taps.weight[k];
  }
  return all;
}

}  // namespace

const SplineWeights internal::kSplineWeights = make_spline_weights();

void smooth_image(const ImageView& image, std::uint16_t* out) {
  for (int v = 0; v < image.height; ++v, out += image.width) {
    const std::uint8_t* here = image.row(v);
    const bool inside = v > 0 && v + 1 < image.height;
    const std::uint8_t* above = inside ? here - image.stride : here;
    const std::uint8_t* below = inside ? here + image.stride : here;
    const auto column = [&](int u) { return above[u] + 4 * here[u] + below[u]; };
    for (int u = 1; u + 1 < image.width; ++u) {
      out[u] = static_cast<std::uint16_t>(column(u - 1) + 4 * column(u) + column(u + 1));
    }
    out[0] = static_cast<std::uint16_t>(kSmoothUnit * here[0]);
    out[image.width - 1] = static_cast<std::uint16_t>(kSmoothUnit * here[image.width - 1]);
  }
}

}  // namespace alidade
