#pragma once
// The centroid of a circle's image is not the image of its centre: perspective and lens shift it by
// some hundredths of a pixel.

#include <algorithm>
#include <cmath>

#include "core/model/trigonometry.h"
#include "core/pattern/lens.h"
#include "core/pattern/pattern_data.h"
#include "core/pattern/pose_curve.h"

namespace alidade {

// Corrects the centres of circles. The detector derived them from centroids with the lens and
// perspective of the grid; this function uses the known lens and pose. Other observations stay.
[[nodiscard]] PatternData recentred(PatternData data, const LensVector& lens,
                                    const PoseCurve& curve);

namespace internal {

struct CircleImage {
  // From the image of the centre to the centroid, px.
  Vector2<double> beside = Vector2<double>::Zero();
  double area = 0;  // px^2
};

// map: from a place on the pattern (in the unit of centre and radius) to px. Uses a polygon of the
// circle's area. Not finite if the map is not.
template <class Map>
[[nodiscard]] CircleImage circle_image(const Map& map, const Vector2<double>& centre,
                                       double radius) {
  constexpr int kCorners = 24;
  const double step = 2 * kPi / kCorners;
  const double reach = radius * std::sqrt(step / std::sin(step));
  const Vector2<double> origin = map(centre);
  Vector2<double> before = map(centre + Vector2<double>(reach, 0)) - origin;
  CircleImage image;
  for (int i = 1; i <= kCorners; ++i) {
    const Vector2<double> corner =
        map(centre + reach * Vector2<double>(std::cos(i * step), std::sin(i * step))) - origin;
    const double twice_area = before.x() * corner.y() - before.y() * corner.x();
    image.area += twice_area / 2;
    image.beside += twice_area / 6 * (before + corner);
    before = corner;
  }
  image.beside /= image.area;
  image.area = std::abs(image.area);
  return image;
}

}  // namespace internal
}  // namespace alidade
