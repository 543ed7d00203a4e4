#include "edge_app/record/orientation_record.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/model/angle.h"

namespace alidade {

OrientationRecord::Orientation orientation_of(const FrameOrientation& frame) {
  OrientationRecord::Orientation orientation;
  orientation.pan_rad = wrap_angle(frame.angle.pan);
  orientation.tilt_rad = wrap_angle(frame.angle.tilt);
  orientation.pan_rate_rad_s = frame.rate.pan;
  orientation.tilt_rate_rad_s = frame.rate.tilt;
  orientation.pan_acceleration_rad_s2 = frame.acceleration.pan;
  orientation.tilt_acceleration_rad_s2 = frame.acceleration.tilt;
  // q and -q are the same rotation: the one with w >= 0 is written.
  const Eigen::Quaterniond q = frame.quaternion();
  const double sign = q.w() < 0 ? -1 : 1;
  orientation.q_base_from_camera = {sign * q.x(), sign * q.y(), sign * q.z(), sign * q.w()};
  for (std::size_t i = 0; i < orientation.sigma_rad.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    // Rounding may make a zero variance negative.
    orientation.sigma_rad[i] = std::sqrt(std::max(frame.orientation_covariance(row, row), 0.0));
  }
  for (std::size_t i = 0; i < orientation.covariance_rad2.size(); ++i) {
    orientation.covariance_rad2[i] = frame.orientation_covariance(static_cast<Eigen::Index>(i / 3),
                                                                  static_cast<Eigen::Index>(i % 3));
  }
  orientation.geometry = pack(frame);
  return orientation;
}

}  // namespace alidade
