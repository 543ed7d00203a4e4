#pragma once
// LocalFrame: latitude, longitude and height to metres east, north and up of an origin, and back
// (WGS84).
//   n = a / sqrt(1 - e^2 sin^2 lat);  x = (n + h) cos lat cos lon, y = (n + h) cos lat sin lon,
//   z = (n (1 - e^2) + h) sin lat;    local = R (x - x_origin), rows of R: east, north, up
// Back: Bowring 1976, iterated. The plane Z = 0 is level at the origin: level ground lies 8 cm
// below the plane at a distance of one kilometre, 2 m at five. Heights are above the ellipsoid, not
// above the sea; only the difference from the origin's height counts. Angles in rad. Domain:
// |latitude| <= pi / 2, heights -10 to 100 km. No allocation.

#include "core/model/linear_algebra.h"

namespace alidade {

struct GeodeticPosition {
  double latitude = 0;   // rad
  double longitude = 0;  // rad
  double height_m = 0;   // above the ellipsoid
};

class LocalFrame {
 public:
  explicit LocalFrame(const GeodeticPosition& origin);

  [[nodiscard]] const GeodeticPosition& origin() const { return origin_; }
  // m: east, north, up.
  [[nodiscard]] Vector3<double> local(const GeodeticPosition& position) const;
  // The inverse. Longitude -pi to pi; on the Earth's axis that of the origin.
  [[nodiscard]] GeodeticPosition geodetic(const Vector3<double>& local_m) const;

 private:
  GeodeticPosition origin_;
  Vector3<double> origin_ecef_;
  Matrix3<double> R_local_from_ecef_;
};

}  // namespace alidade
