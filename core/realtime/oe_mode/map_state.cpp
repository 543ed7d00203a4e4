#include "core/realtime/oe_mode/map_state.h"

#include <Eigen/LU>
#include <cmath>

#include "core/realtime/oe_mode/covariance.h"

namespace alidade {

bool is_valid(const MapState& map) {
  return is_covariance(map.shear_covariance[0]) && is_covariance(map.shear_covariance[1]) &&
         std::isfinite(map.shear_tilt) && all_finite(map.offset.vector()) &&
         is_covariance(map.offset_covariance) && all_finite(map.offset_sensitivity);
}

bool is_valid(const Landmark& landmark) {
  return is_covariance(landmark.covariance) && is_covariance(landmark.shared_covariance) &&
         all_finite(landmark.sensitivity) && std::isnormal(landmark.J_pixel_tangent.determinant());
}

}  // namespace alidade
