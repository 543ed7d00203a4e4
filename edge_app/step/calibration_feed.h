#pragma once
// What the real-time thread tells the calibration thread: for each frame its stamp, the tracks that were
// found in it, and how it went. Fixed size and trivially copyable: crosses the queue by value.

#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <type_traits>

#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/oe_mode/oe_mode.h"
#include "edge_app/step/frame_landmarks.h"
#include "platform/video/frame_source.h"

namespace alidade {

struct TrackedPoint {
  std::uint32_t landmark = 0;
  float u_px = 0;  // CONVENTIONS.md
  float v_px = 0;
  float sigma_px = 0;  // of a component
};

struct FrameTracks {
  // Landmarks of different trackers have nothing in common.
  enum class Tracker : std::uint8_t {
    kNone,     // no image
    kStartUp,  // StartUpTracker: the camera is not calibrated
    kOe        // OeMode
  };

  FrameStamp stamp;
  double time_s = 0;  // filtered capture time of row 0, as in the record
  // False: the stamp says too little of the time, and later ones will not tell.
  bool time_is_of_use = true;
  Tracker tracker = Tracker::kNone;
  bool clock_restarted = false;                  // the frame clock began anew with this frame
  bool delay_stepped = false;                    // the least delay of the video stepped
  double delay_wander_s = 0;                     // by how much it was seen to wander
  bool telemetry_too_old = false;                // beyond max_extrapolation_s
  OeStatus oe_status = OeStatus::kNoPrediction;  // kOe
  int count = 0;
  std::array<TrackedPoint, kMaxFramePoints> points;  // the first `count`
};
static_assert(std::is_trivially_copyable_v<FrameTracks>);

// px, of a component, of an observation that a calibration can use; empty for outliers, and for edges, whose
// open direction one sigma for both components cannot tell of.
[[nodiscard]] inline std::optional<double> track_sigma(const OeObservation& found) {
  const double trace = found.covariance.trace();
  if (!found.inlier || trace >= kUnobservedVariance) return std::nullopt;
  // What all observations of a landmark have in common, about half, moves the landmark instead.
  return std::sqrt(0.25 * trace);
}

}  // namespace alidade
