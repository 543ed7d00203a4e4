#pragma once
// Converts the time stamps of frames and samples to the input of calibrate(), for recordings and
// for the calibration thread. Pure functions; they allocate.
//   counts    Frames are counted by sequence number, else by sender times if these lie on a steady
//             grid. Without either only their receive times are used. Telemetry likewise (sequence,
//             device time).
//   polls     A polled sample has no clock of its own. Its time is the middle of
//             [earliest_time_s, latest_time_s], with sigma = width / sqrt(12). Each poll has an
//             error of its own, and one error is common to all: a device answers at a fixed place
//             of the interval.
//   repeats   Repeats of an old angle while the head turned do not show their own time. They are
//             left out (stale_repeats.h).
//   noise     Receive times err to both sides if the input's noise has a stamp sigma. Otherwise
//             they are only ever late, as in `run` and `replay`.
//   restarts  A sender's clock restarts at a reconnection: only the longest part without a
//             reconnection is used. Polled telemetry, whose times are the host's, is used whole.

#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/video/frame_source.h"

namespace alidade {

// Whether the samples are answers to polls, without a clock or count of the head's own.
[[nodiscard]] bool is_polled(const std::vector<PanTiltSample>& samples);
// The time at which a sample was true, s: the middle of its interval if polled, else its receive
// time.
[[nodiscard]] double stamp_of(const PanTiltSample& sample, bool polled);

// Appends frames to input->frames (samples to input->telemetry), in order of arrival, sets what is
// known of their stamps in *options and in input->noise, and adds a line to *remarks for whatever
// was left out. input->noise must hold what the user states.
void add_frames(std::vector<FrameStamp> stamps, CalibrationInput* input,
                CalibrationOptions* options, std::vector<std::string>* remarks);
void add_telemetry(std::vector<PanTiltSample> samples, CalibrationInput* input,
                   CalibrationOptions* options, std::vector<std::string>* remarks);

}  // namespace alidade
