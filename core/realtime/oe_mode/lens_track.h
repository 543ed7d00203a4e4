#pragma once
// LensTrack: the lens from frame to frame, as the landmarks show it: l = (log f, d log f / dt) at a frame's middle row.
//
// f is the one by which the map's landmarks fit with phi = 0 (lens_scale.h): the camera's is f exp(phi). While the lens moves, frames
// know it to some 1e-5 each by themselves, and a frame's prior is the one before, carried on:
//   log f' = log f + rate dt,   rate' = rate,   both driven by a white acceleration that lasts from frame to frame.
// At rest it is learnt once, as neighbouring frames' landmarks err alike (variance_inflation(), covariance.h).
// Fixed memory; no allocation. One thread.

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/covariance.h"
#include "core/realtime/oe_mode/orientation_solve.h"

namespace alidade {

struct LensTrackOptions {
  double acceleration = 2;  // 1/s^2, > 0: of log f, one standard deviation, while the lens moves
  double drift = 1e-7;      // 1 / sqrt(s), >= 0: of log f at rest
  double longest_s = 0.5;   // s, > 0: that it is carried on for without landmarks
  // 1, > 0: of log f at rest, as far as landmarks that err alike for long tell it at the best.
  double least_sigma = 3e-6;

  // False and one line in *error (if not null) when a value is not valid.
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
  // It may differ from the map's from here on: at rest with that focal length, exactly.
  void begin(double time_s, double log_focal_length);
  [[nodiscard]] bool active() const { return active_; }

  // How long ago landmarks told it, s.
  [[nodiscard]] double age_s(double time_s) const { return std::abs(time_s - time_s_); }
  // Without this frame; moves: it may have since the frame before.
  [[nodiscard]] State predicted(double time_s, bool moves) const;
  // What a frame with landmarks says, whose prior was predicted.
  void learn(double time_s, bool moves, const State& predicted, const State& solved);
  // phi is in the map from here on.
  void move(double phi) { state_.value[0] += phi; }

  [[nodiscard]] const State& state() const { return state_; }
  [[nodiscard]] const LensTrackOptions& options() const { return options_; }

 private:
  LensTrackOptions options_;
  bool active_ = false;
  double time_s_ = 0;
  double learnt_at_rest_s_ = 0;
  bool rested_ = false;  // learnt at rest already, since it moved
  State state_;
};

}  // namespace alidade
