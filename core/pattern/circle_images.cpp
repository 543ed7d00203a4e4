#include "core/pattern/circle_images.h"

#include <limits>

namespace alidade {

PatternData recentred(PatternData data, const LensVector& lens, const PoseCurve& curve) {
  const auto nowhere = Vector2<double>::Constant(std::numeric_limits<double>::quiet_NaN()).eval();
  const double line_delay = lens[index(LensParameter::kLineDelay)];
  for (PatternFrame& frame : data.frames) {
    for (PatternObservation& seen : frame.observations) {
      if (!(seen.radius_m > 0)) continue;
      const PoseVector x = curve.value(curve.basis(frame.time_s + seen.u.y() * line_delay));
      const Matrix3<double> R = curve.R_pattern_from_camera(x);
      const auto map = [&](const Vector2<double>& place) {
        Vector2<double> u = nowhere;
        const Vector3<double> p(place.x(), place.y(), 0);
        const Vector3<double> p_c = R.transpose() * (p - x.head<3>());
        if (project_lens(lens, p_c, &u) != ProjectionStatus::kOk) return nowhere;
        return u;
      };
      const Vector3<double>& centre = data.points_m[static_cast<std::size_t>(seen.point)];
      const Vector2<double> beside =
          internal::circle_image(map, centre.head<2>(), seen.radius_m).beside;
      if (!all_finite(beside)) continue;
      seen.u += seen.beside - beside;
      seen.beside = beside;
    }
  }
  return data;
}

}  // namespace alidade
