#pragma once
// open_recorded_pan_tilt(): the telemetry.csv of a recording (recording.h), at full speed or at the
// pace of its receive times. Without a column earliest_time_s, a sample's interval has no width: it
// is the receive time. read() returns kOk, kTimeout, kEnd, kStopped, or, if the table cannot be
// read as a whole, kFailed.

#include <memory>
#include <string>

#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct RecordingPanTiltSourceOptions {
  std::string directory;
  // True: keeps the pace; the recording's first stamp (of frames and telemetry) is due at the first
  // read().
  bool realtime = false;
};

// Never null. The first read() reads the table.
[[nodiscard]] std::unique_ptr<PanTiltSource> open_recorded_pan_tilt(
    const RecordingPanTiltSourceOptions& options);

}  // namespace alidade
