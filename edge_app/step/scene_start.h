#pragma once
// SceneStart: where a camera without telemetry looks, from one localized picture on until landmarks
// hold.
//   R_base_from_camera(now) = R_base_from_camera(asked) R_asked_from_now
// ask() chooses a frame, another thread localizes it, and settle() delivers the result some frames
// later. TurnChain knows how the camera turned meanwhile. The output replaces telemetry for OE
// mode: pan and tilt of the mount when the middle row is exposed, and their rates. All outputs that
// rest on one localized picture share its error; their correlation_time_s allows for it. Fixed
// memory; no allocation. One thread.

#include <cstdint>
#include <optional>

#include "core/realtime/telemetry/telemetry_interpolation.h"
#include "edge_app/step/told_base.h"
#include "edge_app/step/turn_chain.h"

namespace alidade {

class SceneStart {
 public:
  // To be called for each frame that landmarks do not answer, in order.
  void add(const Calibration& calibration, const FrameTracks& tracks);
  // The frame added last is to be localized. *angular_velocity: rad/s, its camera frame. False: the
  // camera cannot be followed from this frame on.
  [[nodiscard]] bool ask(std::int64_t frame, Vector3<double>* angular_velocity);
  // The result for the frame of ask(); one for another frame is ignored.
  void settle(const ToldBase& told);
  // Ends all this; ask() begins anew.
  void forget();

  // A frame was localized, and the camera was followed since.
  [[nodiscard]] bool is_known() const { return told_.has_value() && chain_.holds(); }
  // s, of the localized frame.
  [[nodiscard]] double told_time_s() const { return told_ ? told_->time_s : 0; }
  // The mount's angles for the frame added last. False: they are not known, or the mount cannot
  // look there.
  [[nodiscard]] bool find(const Calibration& calibration, double telemetry_time_s,
                          InterpolatedPanTilt* out) const;

 private:
  TurnChain chain_;
  std::optional<std::int64_t> asked_;
  std::optional<ToldBase> told_;
};

}  // namespace alidade
