#pragma once
// RecordedFrames: images of a TurningCamera with its telemetry in a file, so that a program without
// OpenCV, on another processor or in an emulator, gets the very same.
// The file is for the machine that made it and for others of its byte order; it is not kept.

#include <cstdint>
#include <string>
#include <vector>

#include "core/model/calibration.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"

namespace alidade::benchmarks {

struct RecordedFrame {
  double time_s = 0;              // row 0
  InterpolatedPanTilt telemetry;  // at the middle row; of its covariance the diagonal only
  std::vector<std::uint8_t> luma;
};

struct RecordedFrames {
  Calibration calibration;  // image size, focal length and line delay; the rest is the default
  std::vector<RecordedFrame> frames;

  [[nodiscard]] ImageView view(std::size_t k) const;
};

// False: the file cannot be written.
[[nodiscard]] bool write_frames(const RecordedFrames& frames, const std::string& file);
// False: there is no such file, or it is not one of these.
[[nodiscard]] bool read_frames(const std::string& file, RecordedFrames* frames);

}  // namespace alidade::benchmarks
