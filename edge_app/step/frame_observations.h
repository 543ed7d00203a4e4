#pragma once
// What an estimator saw in the frame that it processed last: as tracks for the calibration thread, and for people to
// look at. px of the full image (CONVENTIONS.md). No allocation.

#include <optional>

#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/start_up/start_up_tracker.h"
#include "edge_app/step/calibration_feed.h"
#include "edge_app/step/frame_landmarks.h"

namespace alidade {

// Set points, their count and oe_status; the rest stays. More than there is room for are left out.
void get_tracks(const StartUpTracker& tracker, FrameTracks* tracks);
// Without an answer from landmarks (status not kOk) no points.
void get_tracks(const OeMode& mode, FrameTracks* tracks);

void get_landmarks(const StartUpTracker& tracker, FrameLandmarks* landmarks);
// Each where the solution expects it, with its residual.
void get_landmarks(const OeMode& mode, FrameLandmarks* landmarks);

// px, root mean square of the lengths of the residuals that held the result; none where nothing held one.
[[nodiscard]] std::optional<double> residual_rms(const OeMode& mode);

}  // namespace alidade
