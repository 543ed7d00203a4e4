#pragma once
// SceneStart: where a camera without telemetry looks, from one localized picture on, until landmarks hold.
//
//   R_base_from_camera(now) = R_base_from_camera(asked) R_asked_from_now
//
// A frame is asked about (ask), localized by another thread, and told (settle) some frames later; what the camera turned meanwhile tells
// TurnChain. Out comes what OE mode takes for telemetry: pan and tilt of the mount when the middle row is exposed, and their rates. All
// of them since one picture err alike, which correlation_time_s says. Fixed memory; no allocation. One thread.

#include <cstdint>
#include <optional>

#include "core/realtime/telemetry/telemetry_interpolation.h"
#include "edge_app/step/told_base.h"
#include "edge_app/step/turn_chain.h"

namespace alidade {

class SceneStart {
 public:
  // Each frame that landmarks do not answer, in order.
  void add(const Calibration& calibration, const FrameTracks& tracks);
  // The frame last added is to be localized; *angular_velocity: rad/s, its camera frame. False: it cannot be followed from there.
  [[nodiscard]] bool ask(std::int64_t frame, Vector3<double>* angular_velocity);
  void settle(const ToldBase& told);
  void forget();

  // Somebody was asked, and has told, and the camera was followed since.
  [[nodiscard]] bool is_known() const { return told_.has_value() && chain_.holds(); }
  // Of the told frame.
  [[nodiscard]] double told_time_s() const { return told_ ? told_->time_s : 0; }
  // Of the frame last added. False: not known, or nowhere that the mount can look.
  [[nodiscard]] bool find(const Calibration& calibration, double telemetry_time_s,
                          InterpolatedPanTilt* out) const;

 private:
  TurnChain chain_;
  std::optional<std::int64_t> asked_;
  std::optional<ToldBase> told_;
};

}  // namespace alidade
