#pragma once
// Serves the virtual camera on real sockets: video by RTSP (and, if asked for, plain RTP and MJPEG over
// HTTP), pan and tilt by VAPIX (and ONVIF, and as a head on a serial line, TCP or UDP).
//
// All is on the host's CLOCK_MONOTONIC. A frame captured at T is handed to the video server at
// T + video latency (+ jitter), where video latency = telemetry latency - clock_offset. Stamped at
// arrival, it is then to be looked up in the telemetry at stamp + clock_offset: that is the
// clock_offset of truth.yaml, to which the sockets add what they take (about a millisecond).
// Frames are rendered and encoded beforehand: one period of the path if everything repeats after a
// whole number of frames, else the whole duration; so a small machine keeps up.

#include <atomic>

#include "test/simulator/config.h"

namespace alidade::simulator {

// Prints `ready rtsp://... http://...` on stdout once the sockets are open, with ` mjpeg=URL`,
// ` onvif=URL` and ` head=ADDRESS` for what else there is, then serves until the
// duration is over or `stop` is set. Writes truth.yaml and truth.csv into config.truth_dir, if given,
// as it goes (each second). Throws ConfigError or std::runtime_error.
void serve_live(const Config& config, const std::atomic<bool>& stop);

}  // namespace alidade::simulator
