#pragma once
// What an estimator saw in its latest frame: as tracks, for the calibration thread, and as
// landmarks, for display. px of the full image (CONVENTIONS.md). No allocation.

#include <optional>

#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/start_up/start_up_tracker.h"
#include "edge_app/step/calibration_feed.h"
#include "edge_app/step/frame_landmarks.h"

namespace alidade {

// Sets points and count, and leaves the other members as they are. Points beyond kMaxFramePoints
// are left out.
void get_tracks(const StartUpTracker& tracker, FrameTracks* tracks);
// Sets oe_status, too. There are points only if it is kOk: the inliers that are not edges
// (track_sigma()).
void get_tracks(const OeMode& mode, FrameTracks* tracks);

// Both functions set kind, count and found. Points beyond kMaxFramePoints are left out.
void get_landmarks(const StartUpTracker& tracker, FrameLandmarks* landmarks);
// kind is kNone unless the status is kOk. Each landmark is where the solution expects it, with its
// residual (of an edge: the part across it).
void get_landmarks(const OeMode& mode, FrameLandmarks* landmarks);

// px, root mean square length of the inliers' residuals. Empty: there is none.
[[nodiscard]] std::optional<double> residual_rms(const OeMode& mode);

}  // namespace alidade
