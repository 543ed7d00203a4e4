#pragma once
// LensTrack: the lens from frame to frame, as landmarks show it: l = (log f, d log f / dt) at a
// frame's middle row. f is the focal length with which the map's landmarks fit at phi = 0
// (lens_scale.h); the camera's is f exp(phi). A frame's prior is the previous state, extrapolated:
//   log f' = log f + rate dt,   rate' = rate
// log f and rate are driven by an acceleration that is constant between two frames and white from
// frame to frame. While the lens rests, the first frame counts fully. Later frames count less, as
// neighbouring frames share their landmarks' errors (variance_inflation(), covariance.h), and their
// rate is taken as 0, not learnt. Fixed memory; no allocation. One thread.

#include <cmath>

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/covariance.h"

namespace alidade {

// 1/s^2; sigma of the acceleration of log f while a motor moves the lens.
inline constexpr double kZoomAcceleration = 2;

struct LensTrackOptions {
  double acceleration =
      kZoomAcceleration;  // 1/s^2, > 0; sigma of log f's acceleration while the lens moves
  double drift = 1e-7;    // 1 / sqrt(s), >= 0; of log f at rest
  // 1, > 0; smallest sigma of log f at rest, as landmarks have a common error for long.
  double least_sigma = 3e-6;

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

class LensTrack {
 public:
  struct State {
    Vector2<double> value = Vector2<double>::Zero();  // log px, 1/s
    Matrix2<double> covariance = Matrix2<double>::Zero();
    Sensitivity<2> sensitivity = Sensitivity<2>::Zero();
  };

  // options: valid.
  explicit LensTrack(const LensTrackOptions& options) : options_(options) {}

  // The lens is the map's.
  void reset() { active_ = false; }
  // From now on it may differ from the map's. It starts at rest at this log focal length, known to
  // least_sigma.
  void begin(double time_s, double log_focal_length);
  [[nodiscard]] bool active() const { return active_; }

  // s; time since landmarks showed the lens.
  [[nodiscard]] double age_s(double time_s) const { return std::abs(time_s - time_s_); }
  // State without this frame. moves: the lens may have moved since the previous frame.
  [[nodiscard]] State predicted(double time_s, bool moves) const;
  // Takes the solution of a frame with landmarks, whose prior was `predicted`.
  void learn(double time_s, bool moves, const State& predicted, const State& solved);
  // phi was moved into the map: log f grows by it, and phi counts from 0.
  void move(double phi) { state_.value[0] += phi; }

  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] const LensTrackOptions& options() const { return options_; }

 private:
  LensTrackOptions options_;
  bool active_ = false;
  double time_s_ = 0;
  bool rested_ = false;  // already learnt at rest since it moved
  State state_;
};

}  // namespace alidade
