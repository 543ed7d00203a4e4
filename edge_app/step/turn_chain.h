#pragma once
// TurnChain: how a camera turned since some frame, by points that are followed from frame to frame (start_up_tracker.h), without telemetry.
//
//   b_before = Exp(s w) b_now,  s = 1 + l (v_now - v_before) / T     per point, b: its ray in the camera frame
//
// w: rotation vector from this frame's middle row to the one before's, over the time T between them; l: line delay, so that a rolling
// shutter that turns at an even rate does no harm. Robust least squares (Cauchy): what moves by itself counts little.
//   R_from_now = R_from_before Exp(w)    with the covariance of all steps, of R Exp(xi), xi in this frame's camera
// A step with too few points, or too long after the one before, breaks the chain. Fixed memory; no allocation. One thread.

#include <array>
#include <optional>

#include "core/model/calibration.h"
#include "edge_app/step/calibration_feed.h"

namespace alidade {

class TurnChain {
 public:
  // The next frame's points; tracks.time_s and points are read.
  void add(const Calibration& calibration, const FrameTracks& tracks);
  // The chain begins at the frame last added. False: there is nothing to follow in it, or no step led there.
  [[nodiscard]] bool begin();
  void forget();

  // Of the frame last added; none without a step to it.
  [[nodiscard]] const std::optional<Vector3<double>>& angular_velocity() const { return velocity_; }
  // Of its last step: from the frame before to the one last added.
  [[nodiscard]] double step_s() const { return step_s_; }
  // Of the mean rate over the step, (rad/s)^2.
  [[nodiscard]] const Matrix3<double>& velocity_covariance() const { return velocity_covariance_; }

  [[nodiscard]] bool holds() const { return holds_; }
  // holds(): from the frame last added to the one where it began.
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

  std::array<Ray, kMaxFramePoints> before_;  // by landmark
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
