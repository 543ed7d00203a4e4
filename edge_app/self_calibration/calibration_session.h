#pragma once
// CalibrationSession: what was seen of one camera at one zoom through one connection, in bounded memory: stamps and
// tracks of the frames, telemetry, and some images (keyframes). What is older than the limits is forgotten.
//
// Every tenth frame is held out: a calibration of the session does not use it, and is tried on it. Its time then lies
// between its neighbours', as its sender's clock or its count has it.
// Radians, seconds, px. Allocates. One thread.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <unordered_map>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/calibration/held_out.h"
#include "core/model/camera.h"
#include "core/realtime/image/image_view.h"
#include "edge_app/self_calibration/keyframe_map.h"
#include "edge_app/self_calibration/packed_image.h"
#include "edge_app/step/calibration_feed.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct SessionLimits {
  double window_s = 40;  // of frames
  std::size_t max_frames = 1500;
  std::size_t max_keyframes = 16;
  std::size_t max_keyframe_bytes = std::size_t{10}
                                   << 20;  // of all, packed: 8 of 1080 lines; one stays in any case
  std::size_t max_samples = 20000;         // of telemetry; without frames nothing else bounds it
  double telemetry_margin_s = 2;  // kept before the first frame: the clock offset may be so large
  double keyframes_apart = 0.3;   // of the field of view
};

class CalibrationSession {
 public:
  explicit CalibrationSession(const SessionLimits& limits) : limits_(limits) {}

  // Forgets frames and images. Telemetry stays: it is of the same head.
  void clear();

  void add(const FrameTracks& tracks);
  // One that begins a new connection (restarted) makes those before it forgotten.
  void add(const PanTiltSample& sample);
  // Whether the head points where no image was taken yet. False without frames or telemetry.
  [[nodiscard]] bool wants_keyframe(const Camera<double>& camera) const;
  // The image of the frame last added; copied. Takes the place of the oldest where there are enough, or
  // where they take too much memory. Needs a frame.
  void add_keyframe(const ImageView& image);

  [[nodiscard]] bool empty() const { return frames_.empty(); }
  [[nodiscard]] std::size_t frames() const { return frames_.size(); }
  // Receive times; 0 without frames.
  [[nodiscard]] double span_s() const;
  [[nodiscard]] double newest_s() const;

  // Frames in the order in which they came.
  [[nodiscard]] std::vector<FrameStamp> stamps() const;
  [[nodiscard]] std::vector<PanTiltSample> telemetry() const;
  [[nodiscard]] std::vector<CalibrationObservation> observations() const;

  // By the frame's place among the stamps.
  [[nodiscard]] static bool is_held_out(std::size_t place);
  // Of the frames that the result used, and of the held-out ones between two of them.
  [[nodiscard]] FrameTimes frame_times(const CalibrationResult& result) const;
  // Those of frames that have a time.
  [[nodiscard]] std::vector<Keyframe> keyframes(const CalibrationResult& result) const;

 private:
  struct KeptFrame {
    FrameStamp stamp;
    std::vector<TrackedPoint> points;
  };
  struct KeptImage {
    std::int64_t frame;
    double receive_time_s;
    double pan, tilt;  // rad, as measured last before it
    std::shared_ptr<const PackedImage> image;
  };

  SessionLimits limits_;
  std::deque<KeptFrame> frames_;
  std::deque<PanTiltSample> telemetry_;
  std::vector<KeptImage> images_;
  PanTilt<double> last_angle_;
};

}  // namespace alidade
