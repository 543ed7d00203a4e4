#include "edge_app/verify/pair_rows.h"

#include <cmath>

namespace alidade {
namespace {

bool linearise(const FrameOrientation& first, const FrameOrientation& second,
               const PlaceMatch& match, PlaceRow* row) {
  Vector3<double> d;
  Matrix<double, 3, 4> J_d_motion;
  Matrix<double, 3, kParameterCount> J_d_parameters;
  if (rolling_shutter_unproject(first.calibration.camera, first.calibration.mechanics,
                                first.calibration.line_delay, first.motion(), match.first, &d,
                                nullptr, &J_d_motion, &J_d_parameters) != ProjectionStatus::kOk) {
    return false;
  }
  Vector2<double> expected;
  Matrix<double, 2, 3> J_u_d;
  Matrix<double, 2, kParameterCount> J_u_parameters;
  if (rolling_shutter_project(second.calibration.camera, second.calibration.mechanics,
                              second.calibration.line_delay, second.motion(), d, &expected, &J_u_d,
                              &row->J_second, &J_u_parameters) != ProjectionStatus::kOk) {
    return false;
  }
  row->at = match.second;
  row->moved = match.second - match.first;
  row->residual = match.second - expected;
  row->covariance = match.covariance;
  row->J_first = J_u_d * J_d_motion;
  row->P_first = J_u_d * J_d_parameters + row->J_first * first.motion_sensitivity.topRows<4>();
  row->P_second = J_u_parameters + row->J_second * second.motion_sensitivity.topRows<4>();
  return true;
}

}  // namespace

bool is_same_zoom(const FrameOrientation& a, const FrameOrientation& b) {
  const double f = a.calibration.camera.focal_length;
  return std::abs(b.calibration.camera.focal_length - f) <= kSameZoom * f;
}

std::vector<PairRows> pair_rows(const std::vector<SeenFrame>& frames,
                                const std::vector<PlacePair>& pairs, OrientationFrom from) {
  std::vector<PairRows> out;
  for (const PlacePair& pair : pairs) {
    const FrameOrientation& first = orientation(frames[pair.first], from);
    const FrameOrientation& second = orientation(frames[pair.second], from);
    if (first.mode == OrientationMode::kNone || second.mode == OrientationMode::kNone) continue;
    PairRows rows{pair.first, pair.second, {}};
    for (const PlaceMatch& match : pair.places) {
      PlaceRow row;
      if (linearise(first, second, match, &row)) rows.places.push_back(row);
    }
    if (!rows.places.empty()) out.push_back(std::move(rows));
  }
  return out;
}

}  // namespace alidade
