#pragma once
// From the stamps of frames and samples to what calibrate() takes; for a recording as for the
// calibration thread.
//   clocks  Frames are counted by their sequence numbers, else by sender times that lie on a steady grid,
//           else by their stamps. Telemetry likewise (sequence, device time); samples that were polled have
//           no clock of their own, and were true in the middle of [earliest_time_s, receive_time_s], give or
//           take width / sqrt(12): each by itself, and, as a device answers in its own way, all alike.
//   repeats of an old angle while the head turned say nothing of their own time: left out (stale_repeats.h).
//   stamps  of receipt: with a stamp sigma in the input's noise they err to both sides, otherwise they are late
//           only, as for `run` and `replay`.
//   restarts  A sender's clock begins anew after a reconnection: the longest part without one is used.
// Pure functions; they allocate.

#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/video/frame_source.h"

namespace alidade {

// Whether the samples are answers to questions, each of about when its stamps say, without a clock or count of the head's own.
[[nodiscard]] bool is_polled(const std::vector<PanTiltSample>& samples);
// When a sample was true, by its stamps: one of those that were polled in the middle of its interval.
[[nodiscard]] double stamp_of(const PanTiltSample& sample, bool polled);

// Frames into input->frames, and what is known of their stamps into *options; remarks get a line for what was left out.
void add_frames(std::vector<FrameStamp> stamps, CalibrationInput* input,
                CalibrationOptions* options, std::vector<std::string>* remarks);
void add_telemetry(std::vector<PanTiltSample> samples, CalibrationInput* input,
                   CalibrationOptions* options, std::vector<std::string>* remarks);

}  // namespace alidade
