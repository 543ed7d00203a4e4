#pragma once
// One target as an extended Kalman filter: place and velocity at constant velocity, disturbed by white acceleration.
//   kPlane   s = [X, Y, X', Y'] in metres on the world plane                                    (Lisanti et al. 14, 15)
//   kSphere  s = [azimuth, elevation and their rates] in radians, where there is no plane. They are counted in a chart of the target's
//            own, R_base_from_chart, whose x axis is the target and whose y axis and -z axis are the directions in which azimuth and
//            elevation grow there; it goes with the target along a great circle. So the place's mean is (0, 0), no angle wraps, and the
//            poles are places like others: azimuth_elevation() gives the angles and rates in base.
//   predict  P(t|t-1) = A P A^T + Q, Q the integral of the white acceleration's density q: m^2/s^3 or rad^2/s^3
//   measured p = H w divided by its third coordinate, w = (X, Y, 1) or the direction in base: H is the homography G(t) of the plane, or
//            K R_camera_from_base for the sphere, and is linearised at the prediction (14). The identity measures places on the plane
//   update   W = P J^T S^-1, S = J P J^T + V (16, 17); V is the detection's covariance in measured coordinates, which the caller
//            gives: this room knows no camera. With weights of several detections: the mean and the covariance of the mixture
// Measured coordinates are pixels, or metres with the identity. Fixed size, no allocation, no shared state.

#include <optional>

#include "core/model/linear_algebra.h"

namespace alidade {

enum class TargetSpace { kPlane, kSphere };

struct TargetState {
  Vector4<double> mean = Vector4<double>::Zero();  // sphere: the place is (0, 0)
  Matrix4<double> cov = Matrix4<double>::Identity();
  Matrix3<double> R_base_from_chart = Matrix3<double>::Identity();  // the identity on the plane
};

struct TargetMeasurement {
  Vector2<double> place = Vector2<double>::Zero();
  Matrix2<double> cov = Matrix2<double>::Identity();  // V(t)
};

// Where a state is expected in measured coordinates.
struct ExpectedPlace {
  Vector2<double> place = Vector2<double>::Zero();
  Matrix2<double> J_place_position = Matrix2<double>::Identity();  // G(t) linearised
  Matrix2<double> cov = Matrix2<double>::Identity();               // J P J^T: of the state alone
};

struct Innovation {
  Vector2<double> difference = Vector2<double>::Zero();       // measured - expected
  Matrix2<double> inverse_cov = Matrix2<double>::Identity();  // S^-1
  double distance_squared = 0;                                // chi-square of two degrees
  double density = 0;  // of the measurement, Gaussian, per unit of measured area
};

// What a target becomes that one measurement shows: at rest with this velocity's sigma (m/s or rad/s). Empty: H takes no place of the plane,
// or no direction, there (beyond the horizon, or H singular).
[[nodiscard]] std::optional<TargetState> first_state(TargetSpace space,
                                                     const Matrix3<double>& H_measured_from_world,
                                                     const TargetMeasurement& measurement,
                                                     double sigma_velocity);

// dt_s not negative, q as above.
void predict_target(TargetSpace space, double dt_s, double acceleration_density,
                    TargetState* state);

// Empty: behind the camera.
[[nodiscard]] std::optional<ExpectedPlace> expected_place(
    TargetSpace space, const TargetState& state, const Matrix3<double>& H_measured_from_world);

[[nodiscard]] Innovation innovation_of(const ExpectedPlace& expected,
                                       const TargetMeasurement& measurement);

// weights[i] belongs to innovations[i]; what they leave of 1 is the weight of the prediction. Their sum is at most 1.
void update_target(TargetSpace space, const ExpectedPlace& expected, const Innovation* innovations,
                   const double* weights, int count, TargetState* state);

// The direction of a state on the sphere, base.
[[nodiscard]] Vector3<double> target_direction(const TargetState& state);

struct AzimuthElevation {
  Vector4<double> value =
      Vector4<double>::Zero();  // azimuth [-pi, pi), elevation, rad; rates, rad/s
  Matrix4<double> cov = Matrix4<double>::Identity();  // of these
};
// Azimuth grows to the right, elevation upwards, base being forward-right-down. Empty: within a microradian of a pole, where there is no azimuth.
[[nodiscard]] std::optional<AzimuthElevation> azimuth_elevation(const TargetState& state);

}  // namespace alidade
