#pragma once
// What the real-time thread passes to the calibration thread for each frame: its time stamp, the
// tracks found in it, and how OE mode did. Fixed size and trivially copyable: crosses the queue by
// value.

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
  float u_px = 0;      // px, u right (CONVENTIONS.md)
  float v_px = 0;      // px, v down
  float sigma_px = 0;  // px, of one component
};

struct FrameTracks {
  // Trackers number their landmarks independently: ids of different trackers are not related.
  enum class Tracker : std::uint8_t {
    kNone,     // no image
    kStartUp,  // StartUpTracker: the camera is not calibrated
    kOe        // OeMode
  };

  FrameStamp stamp;
  double time_s = 0;  // s, host clock: filtered capture time of row 0, as in the record
  // False: the time is not known well enough for calibration, and later frames will not improve it.
  bool time_is_of_use = true;
  Tracker tracker = Tracker::kNone;
  bool clock_restarted = false;    // the frame clock restarted with this frame
  bool delay_stepped = false;      // the least delay of the video, or the sender's clock, stepped
  double delay_wander_s = 0;       // s, by how much the video's delay wanders; 0: it does not
  bool image_repeated = false;     // sent again while the camera turned
  bool telemetry_too_old = false;  // the frame lies beyond max_extrapolation_s
  OeStatus oe_status = OeStatus::kNoPrediction;  // set if tracker is kOe
  int count = 0;
  std::array<TrackedPoint, kMaxFramePoints> points;  // the first `count` are valid
};
static_assert(std::is_trivially_copyable_v<FrameTracks>);

// The sigma of an observation for the calibration: px, of one component. Empty for an outlier, and
// for an edge: one sigma for both components cannot describe that the position along an edge is
// open.
[[nodiscard]] inline std::optional<double> track_sigma(const OeObservation& found) {
  const double trace = found.covariance.trace();
  if (!found.inlier || trace >= kUnobservedVariance) return std::nullopt;
  // About half of the variance is common to all observations of a landmark. It only shifts the
  // landmark.
  return std::sqrt(0.25 * trace);
}

}  // namespace alidade
