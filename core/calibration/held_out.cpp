#include "core/calibration/held_out.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/model/direction.h"
#include "core/model/rolling_shutter.h"

namespace alidade {

std::optional<double> held_out_error(const std::vector<CalibrationObservation>& held_out,
                                     const FrameTimes& time_of, const CalibrationResult& result) {
  std::unordered_map<std::int64_t, const CalibrationLandmark*> landmark_of;
  for (const CalibrationLandmark& landmark : result.landmarks)
    landmark_of[landmark.landmark] = &landmark;
  const Calibration& c = result.calibration;
  std::vector<double> squares;
  for (const CalibrationObservation& seen : held_out) {
    const auto time_s = time_of.find(seen.frame);
    const auto landmark = landmark_of.find(seen.landmark);
    if (time_s == time_of.end() || landmark == landmark_of.end()) continue;
    const FrameMotion<double> motion{result.trajectory.position(time_s->second),
                                     result.trajectory.rate(time_s->second),
                                     0.0,
                                     {}};
    const Vector3<double>& d_b = landmark->second->d_b;
    Vector2<double> u = Vector2<double>::Zero();
    Matrix<double, 2, 3> J_u_d = Matrix<double, 2, 3>::Zero();
    if (rolling_shutter_project(c.camera, c.mechanics, c.line_delay, motion, d_b, &u, &J_u_d) !=
        ProjectionStatus::kOk) {
      continue;
    }
    const Matrix2<double> J = J_u_d * tangent_basis(d_b);
    const Matrix2<double> covariance = seen.sigma_px * seen.sigma_px * Matrix2<double>::Identity() +
                                       J * landmark->second->covariance * J.transpose();
    const Vector2<double> residual = Vector2<double>(seen.u_px, seen.v_px) - u;
    squares.push_back(residual.dot(covariance.inverse() * residual));
  }
  if (squares.empty()) return std::nullopt;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  return std::sqrt(*middle / (2 * std::log(2.0)));
}

}  // namespace alidade
