#pragma once
// open_recorded_frames(): the frames of a recording (recording.h), at full speed or at the pace of
// their receive times. Stamps and frame numbers are those of frames.csv. Pictures come from
// video.mkv (row k of frames.csv belongs to picture k) or from frames/<frame, 6 digits>.png, .jpg
// or .pgm; other pixels than grey or 8-bit YUV are converted. A recording with tracks.csv instead
// of pictures, and any recording if decode is false, gives frames without luma. Pictures that
// cannot be decoded are skipped and counted. If video.mkv ends before frames.csv, the recording
// ends there; missing_frames() is the number of rows left. kFailed: a table, video.mkv or a file of
// frames/ is missing or cannot be read, or a picture has not recording.yaml's size. B-frames:
// docs/derivations.md.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "platform/video/frame_source.h"

namespace alidade {

struct RecordingFrameSourceOptions {
  std::string directory;
  bool decode = true;
  // True: keeps the pace; the recording's first stamp (of frames and telemetry) is due at the first
  // read().
  bool realtime = false;
};

class RecordingFrameSource : public FrameSource {
 public:
  [[nodiscard]] virtual std::int64_t damaged_frames() const = 0;
  [[nodiscard]] virtual std::int64_t missing_frames() const = 0;  // valid after kEnd
  // Notes for the user on the pictures read so far, one line each.
  [[nodiscard]] virtual std::vector<std::string> remarks() const = 0;
};

// Never null. The first read() reads the tables.
[[nodiscard]] std::unique_ptr<RecordingFrameSource> open_recorded_frames(
    const RecordingFrameSourceOptions& options);

}  // namespace alidade
