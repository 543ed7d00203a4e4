#pragma once
// Converts what an estimator saw in the frame it processed last to tracks for the calibration
// thread, and to landmarks for display. px of the full image (CONVENTIONS.md). No allocation.

#include <optional>

#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/start_up/start_up_tracker.h"
#include "edge_app/step/calibration_feed.h"
#include "edge_app/step/frame_landmarks.h"

namespace alidade {

// Sets points and count, and leaves the rest. Points that exceed the room are left out.
void get_tracks(const StartUpTracker& tracker, FrameTracks* tracks);
// Also sets oe_status. No points unless it is kOk; of the landmarks found, only inliers that are no
// edges (track_sigma()).
void get_tracks(const OeMode& mode, FrameTracks* tracks);

void get_landmarks(const StartUpTracker& tracker, FrameLandmarks* landmarks);
// Each at the position that the solution expects, with its residual.
void get_landmarks(const OeMode& mode, FrameLandmarks* landmarks);

// px, root mean square length of the inliers' residuals. Empty if there are none.
[[nodiscard]] std::optional<double> residual_rms(const OeMode& mode);

}  // namespace alidade
