#pragma once
// TurnChain: how a camera has turned since some frame (`first`), without telemetry, by points
// followed from frame to frame (start_up_tracker.h). A step leads from the frame `before` to the
// frame added last (`now`). For each point in both, with rays b in their camera frames:
//   b_before = Exp(s w) b_now,  s = 1 + l (v_now - v_before) / T,  R_before_from_now = Exp(w)
// w is of the middle rows, T the time between them, l the line delay, v a row: exact for a camera
// that turns at an even rate. Robust least squares (Cauchy): points that move by themselves count
// little. R_first_from_now = R_first_from_before Exp(w); its covariance is of R Exp(xi), xi in the
// camera frame of `now`. There is no step, and the chain ends, with fewer than 12 common points or
// half of their weight, with T not in (0, 0.5 s), or after a bad fit. Radians, seconds. Fixed
// memory; no allocation. One thread.

#include <array>
#include <optional>

#include "core/model/calibration.h"
#include "edge_app/step/calibration_feed.h"

namespace alidade {

class TurnChain {
 public:
  // The next frame's points, in any order; reads tracks.time_s and the points. Ids must be those of
  // one tracker.
  void add(const Calibration& calibration, const FrameTracks& tracks);
  // Begins the chain at the frame added last, which becomes `first`. False: no step led to that
  // frame, and there is no chain.
  [[nodiscard]] bool begin();
  // Ends the chain and forgets the points: no step leads to the next frame.
  void forget();

  // rad/s, of `now` against the world, in its camera frame: the mean over the last step. Empty if
  // no step led to the frame added last.
  [[nodiscard]] const std::optional<Vector3<double>>& angular_velocity() const { return velocity_; }
  // Only if angular_velocity() is set. s, of the last step: T.
  [[nodiscard]] double step_s() const { return step_s_; }
  // Likewise. (rad/s)^2, of that mean rate.
  [[nodiscard]] const Matrix3<double>& velocity_covariance() const { return velocity_covariance_; }

  // Steps led from `first` to the frame added last without a gap.
  [[nodiscard]] bool holds() const { return holds_; }
  // Only if holds(). The covariance is in rad^2, without errors of the lens.
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
