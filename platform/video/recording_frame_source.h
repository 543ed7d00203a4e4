#pragma once
// open_recorded_frames(): the frames of a recording (recording.h), at full speed or at the pace of
// their receive times. Stamps, frame numbers included, are those of frames.csv.
//
// Pictures come from video.mkv (row k of frames.csv belongs to picture k) or from
// frames/<frame, 6 digits>.png, .jpg or .pgm. A recording with tracks.csv in place of pictures, and
// any recording if decode is false, yields frames without luma.
// Pictures must have an 8-bit luma plane (grey, or YUV) and recording.yaml's size. One that cannot
// be decoded is skipped and counted. Where video.mkv has B-frames, picture k is the k-th in the order in which they were
// taken; rows whose sender_time_s tell another order are refused. When video.mkv ends before frames.csv, as after a kill of the
// recorder, the recording ends there, and missing_frames() tells how many rows were left.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "platform/video/frame_source.h"

namespace alidade {

struct RecordingFrameSourceOptions {
  std::string directory;
  bool decode = true;
  // Pace: the recording's first stamp (of frames and telemetry) is due at the first read().
  bool realtime = false;
};

class RecordingFrameSource : public FrameSource {
 public:
  [[nodiscard]] virtual std::int64_t damaged_frames() const = 0;
  [[nodiscard]] virtual std::int64_t missing_frames() const = 0;  // valid after kEnd
  // What a person should know of the pictures read so far, one line each.
  [[nodiscard]] virtual std::vector<std::string> remarks() const = 0;
};

[[nodiscard]] std::unique_ptr<RecordingFrameSource> open_recorded_frames(
    const RecordingFrameSourceOptions& options);

}  // namespace alidade
