#pragma once
// What the real-time thread tells the calibration thread: for each frame its stamp, the tracks that were
// found in it, and how it went. Fixed size and trivially copyable: crosses the queue by value.

#include <array>
#include <cstdint>
#include <type_traits>

#include "core/realtime/oe_mode.h"
#include "platform/video/frame_source.h"

namespace alidade {

struct TrackedPoint {
  std::uint32_t landmark = 0;
  float u_px = 0;  // CONVENTIONS.md
  float v_px = 0;
  float sigma_px = 0;  // of a component
};

struct FrameTracks {
  static constexpr int kMaxPoints = 256;

  // Landmarks of different trackings, and of different runs of one tracker, have nothing in common.
  enum class Tracker : std::uint8_t {
    kNone,     // no picture
    kStartUp,  // StartUpTracker: the camera is not calibrated
    kOe        // OeMode
  };

  FrameStamp stamp;
  double time_s = 0;  // filtered capture time of row 0, as in the record
  Tracker tracker = Tracker::kNone;
  std::uint32_t run = 0;                         // of that tracker: another one since it began anew
  bool clock_restarted = false;                  // the frame clock began anew with this frame
  bool floor_shifted = false;                    // the least delay of the video stepped
  OeStatus oe_status = OeStatus::kNoPrediction;  // kOe
  int looked_for = 0;                            // points expected in the picture
  int count = 0;
  std::array<TrackedPoint, kMaxPoints> points;  // the first `count`
};
static_assert(std::is_trivially_copyable_v<FrameTracks>);

}  // namespace alidade
