#pragma once
// SeenFrame: a frame of the recording with its image and its orientation by OE mode, by PT mode,
// and by PT mode with the samples after the frame, which a live step does not have yet.
// FrameCollection: the frames of a replay that are compared with each other, evenly over the
// recording: at most 160, and as many as fit into 256 MB. A frame without image, in the first
// second, or for which telemetry has no certain answer is replaced by the next. Allocates. One
// thread.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/model/angle.h"
#include "core/model/mechanics.h"
#include "core/realtime/frame_orientation.h"
#include "core/realtime/image/image_view.h"
#include "edge_app/record/orientation_record.h"

namespace alidade {

struct SeenFrame {
  double time_s = 0;                // s, image clock; capture of row 0
  double time_sigma_s = 0;          // of time_s; the error may be common to all frames
  FrameOrientation by_telemetry;    // PT mode, by the samples that had come when the frame came
  FrameOrientation by_all_samples;  // PT mode, by the samples after the frame, too
  FrameOrientation by_landmarks;    // OE mode; mode kNone: landmarks did not hold
  PanTilt<double> heading{0, 0};    // sign of each axis's last motion, -1 or 1; 0: not known
  std::vector<std::uint8_t> luma;   // row by row, without gaps
  // Lent with this object.
  [[nodiscard]] ImageView image() const {
    const Camera<double>& camera = by_telemetry.calibration.camera;
    return {luma.data(), camera.width, camera.height, camera.width};
  }
};

class FrameCollection {
 public:
  // frames: their number in the recording. width, height: px. angle_sigma_rad: noise of a measured
  // angle; a change of this size is no movement.
  FrameCollection(std::size_t frames, int width, int height, double angle_sigma_rad);

  // The next frame's records, for every frame in order. image: copied; not valid() if there is
  // none.
  void add(const OrientationRecord& by_landmarks, const OrientationRecord& by_telemetry,
           const OrientationRecord& by_all_samples, const ImageView& image);

  [[nodiscard]] const std::vector<SeenFrame>& frames() const { return frames_; }

 private:
  void note_heading(const PanTilt<double>& angle);

  std::size_t of_recording_;
  std::size_t wanted_;
  double clear_rad_;
  std::size_t next_ = 0;    // of the recording
  std::size_t chosen_ = 0;  // so far, with or without success
  std::optional<double> begin_s_;
  bool has_angle_ = false;
  PanTilt<double> turned_from_;  // the farthest point of the present direction
  PanTilt<double> heading_{0, 0};
  std::vector<SeenFrame> frames_;
};

}  // namespace alidade
