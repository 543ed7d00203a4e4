#pragma once
// TurnChain: how a camera has turned since some frame, without telemetry, by points followed from
// frame to frame (start_up_tracker.h). For each point with ray b in the camera frame:
//   b_before = Exp(s w) b_now,  s = 1 + l (v_now - v_before) / T
// w is the rotation vector from this frame's middle row to the middle row of the frame before, T
// the time between the two. l is the line delay: a rolling shutter that turns at an even rate does
// no harm.
// Robust least squares (Cauchy): points that move by themselves count little. The steps multiply,
// R_from_now = R_from_before Exp(w), with the covariance of all steps, of R Exp(xi), xi in this
// frame's camera frame. A step with too few points, or after too long a time, breaks the chain.
// Radians, seconds. Fixed memory; no allocation. One thread.

#include <array>
#include <optional>

#include "core/model/calibration.h"
#include "edge_app/step/calibration_feed.h"

namespace alidade {

class TurnChain {
 public:
  // The next frame's points; reads tracks.time_s and the points.
  void add(const Calibration& calibration, const FrameTracks& tracks);
  // Begins the chain at the frame added last. False: no step led to that frame.
  [[nodiscard]] bool begin();
  void forget();

  // rad/s, camera frame, of the frame added last; empty if no step led to it.
  [[nodiscard]] const std::optional<Vector3<double>>& angular_velocity() const { return velocity_; }
  // s, of the last step: from the frame before to the frame added last.
  [[nodiscard]] double step_s() const { return step_s_; }
  // (rad/s)^2, of the mean rate over the step.
  [[nodiscard]] const Matrix3<double>& velocity_covariance() const { return velocity_covariance_; }

  [[nodiscard]] bool holds() const { return holds_; }
  // If holds(): from the frame added last to the first one, and its covariance, rad^2.
  [[nodiscard]] const Matrix3<double>& R_first_from_now() const { return R_first_from_now_; }
  [[nodiscard]] const Matrix3<double>& covariance() const { return covariance_; }

 private:
  struct Step {
    Vector3<double> turn;
    Matrix3<double> covariance;
  };
  struct Ray {
    std::uint32_t landmark = 0;
    double v = 0;
    double sigma = 0;  // rad
    Vector3<double> d;
  };
  [[nodiscard]] std::optional<Step> step(double line_delay, double elapsed_s) const;
  void take(const Calibration& calibration, const FrameTracks& tracks);

  std::array<Ray, kMaxFramePoints> before_;  // sorted by landmark
  std::array<Ray, kMaxFramePoints> now_;
  int before_count_ = 0;
  int now_count_ = 0;
  double time_s_ = 0;
  double step_s_ = 0;
  std::optional<Vector3<double>> velocity_;
  Matrix3<double> velocity_covariance_ = Matrix3<double>::Zero();
  bool holds_ = false;
  Matrix3<double> R_first_from_now_ = Matrix3<double>::Identity();
  Matrix3<double> covariance_ = Matrix3<double>::Zero();
};

}  // namespace alidade
