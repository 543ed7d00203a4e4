#pragma once
// One target's extended Kalman filter: place and velocity, with white acceleration.
//   kPlane   s = [X, Y, X', Y'], m on the world plane                       (Lisanti et al. 14, 15)
//   kSphere  s = [azimuth, elevation, rates], rad, in a chart that moves with the target
//   predict  P(t|t-1) = A P A^T + Q, Q from the acceleration's density q: m^2/s^3 or rad^2/s^3
//   update   W = P J^T S^-1, S = J P J^T + V                       (16, 17); V: detection's
// H_measured_from_world is a homography from the plane, or from directions in base, to measured
// coordinates: pixels, or metres if H is the identity. In the chart no angle wraps, and poles are
// ordinary places. Several weighted detections give the mixture's mean and covariance. Fixed size;
// no allocation, no shared state. Details: docs/derivations.md.

#include <optional>

#include "core/model/linear_algebra.h"

namespace alidade {

enum class TargetSpace { kPlane, kSphere };

// In the units of its TargetSpace.
struct TargetState {
  Vector4<double> mean = Vector4<double>::Zero();  // s; on the sphere the place is (0, 0)
  Matrix4<double> cov = Matrix4<double>::Identity();
  Matrix3<double> R_base_from_chart = Matrix3<double>::Identity();  // the identity on the plane
};

// In measured coordinates: px or m.
struct TargetMeasurement {
  Vector2<double> place = Vector2<double>::Zero();
  Matrix2<double> cov = Matrix2<double>::Identity();  // V(t)
};

// Expected place of a state in measured coordinates.
struct ExpectedPlace {
  Vector2<double> place = Vector2<double>::Zero();
  Matrix2<double> J_place_position = Matrix2<double>::Identity();  // G(t) linearised
  Matrix2<double> cov = Matrix2<double>::Identity();               // J P J^T: from the state alone
};

struct Innovation {
  Vector2<double> difference = Vector2<double>::Zero();       // measured - expected
  Matrix2<double> inverse_cov = Matrix2<double>::Identity();  // S^-1
  double distance_squared = 0;                                // chi-square, two degrees of freedom
  double density = 0;  // Gaussian, of the measurement, per unit of measured area
};

// The state after one measurement: at rest, with this sigma of velocity (m/s or rad/s). Empty if no
// place of the plane, or no direction, is at the measurement (it is beyond the horizon, or H is
// singular), or if the result is not finite.
[[nodiscard]] std::optional<TargetState> first_state(TargetSpace space,
                                                     const Matrix3<double>& H_measured_from_world,
                                                     const TargetMeasurement& measurement,
                                                     double sigma_velocity);

// dt_s >= 0. acceleration_density: q.
void predict_target(TargetSpace space, double dt_s, double acceleration_density,
                    TargetState* state);

// Empty if the place is behind the camera.
[[nodiscard]] std::optional<ExpectedPlace> expected_place(
    TargetSpace space, const TargetState& state, const Matrix3<double>& H_measured_from_world);

[[nodiscard]] Innovation innovation_of(const ExpectedPlace& expected,
                                       const TargetMeasurement& measurement);

// weights[i] belongs to innovations[i], i < count. The weights' sum is at most 1; the rest is the
// weight of the prediction.
void update_target(TargetSpace space, const ExpectedPlace& expected, const Innovation* innovations,
                   const double* weights, int count, TargetState* state);

// The direction of a state on the sphere, in base, unit length.
[[nodiscard]] Vector3<double> target_direction(const TargetState& state);

struct AzimuthElevation {
  // Azimuth in [-pi, pi) and elevation, rad; their rates, rad/s.
  Vector4<double> value = Vector4<double>::Zero();
  Matrix4<double> cov = Matrix4<double>::Identity();  // of value
};
// Azimuth and elevation of a state on the sphere. Azimuth grows to the right and elevation upwards;
// base is forward-right-down. Empty within a microradian of a pole, where azimuth is undefined.
[[nodiscard]] std::optional<AzimuthElevation> azimuth_elevation(const TargetState& state);

}  // namespace alidade
