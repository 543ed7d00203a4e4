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

FrameOrientation with(const Vector4<double>& error, FrameOrientation frame) {
  frame.angle = {frame.angle.pan + error[0], frame.angle.tilt + error[1]};
  frame.rate = {frame.rate.pan + error[2], frame.rate.tilt + error[3]};
  frame.motion_sensitivity = telemetry_sensitivity(frame.calibration.mechanics, frame.motion());
  return frame;
}

// visit(row): may change a row before it is kept.
template <class OrientationOf, class Visit>
std::vector<PairRows> rows_of(const std::vector<PlacePair>& pairs,
                              const OrientationOf& orientation_of, const Visit& visit) {
  std::vector<PairRows> out;
  for (const PlacePair& pair : pairs) {
    const FrameOrientation& first = orientation_of(pair.first);
    const FrameOrientation& second = orientation_of(pair.second);
    if (first.mode == OrientationMode::kNone || second.mode == OrientationMode::kNone) continue;
    PairRows rows{pair.first, pair.second, {}};
    for (const PlaceMatch& match : pair.places) {
      PlaceRow row;
      if (!linearise(first, second, match, &row)) continue;
      visit(pair, &row);
      rows.places.push_back(row);
    }
    if (!rows.places.empty()) out.push_back(std::move(rows));
  }
  return out;
}

}  // namespace

bool is_same_zoom(const FrameOrientation& a, const FrameOrientation& b) {
  const double f = a.calibration.camera.focal_length;
  return std::abs(b.calibration.camera.focal_length - f) <= kSameZoom * f;
}

std::vector<PairRows> pair_rows(const std::vector<SeenFrame>& frames,
                                const std::vector<PlacePair>& pairs, OrientationFrom from) {
  return rows_of(
      pairs,
      [&](std::size_t frame) -> const FrameOrientation& {
        return orientation(frames[frame], from);
      },
      [](const PlacePair&, PlaceRow*) {});
}

std::vector<PairRows> pair_rows_at(const std::vector<Vector4<double>>& errors,
                                   const std::vector<SeenFrame>& frames,
                                   const std::vector<PlacePair>& pairs) {
  std::vector<FrameOrientation> corrected;
  corrected.reserve(frames.size());
  for (std::size_t i = 0; i < frames.size(); ++i)
    corrected.push_back(with(errors[i], frames[i].by_all_samples));
  return rows_of(
      pairs, [&](std::size_t frame) -> const FrameOrientation& { return corrected[frame]; },
      [&](const PlacePair& pair, PlaceRow* row) {
        row->residual += row->J_first * errors[pair.first] + row->J_second * errors[pair.second];
      });
}

}  // namespace alidade
