#pragma once
// CalibrationSession: what was observed of one camera, at one zoom, through one connection: time
// stamps and tracks of frames, telemetry, and some images (keyframes). Memory is bounded: whatever
// exceeds the limits is forgotten, the oldest first.
//
// Every tenth frame is held out: a calibration of the session does not use this frame and is tested
// on it. The frame's time is interpolated between its neighbours' times, by the sender's clock,
// else by the sequence numbers, else it is their middle.
// Radians, seconds, px. Allocates. One thread.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/calibration/held_out.h"
#include "core/model/lens/camera.h"
#include "core/realtime/image/image_view.h"
#include "edge_app/self_calibration/keyframe_map.h"
#include "edge_app/self_calibration/packed_image.h"
#include "edge_app/self_calibration/view_coverage.h"
#include "edge_app/step/calibration_feed.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct SessionLimits {
  double window_s = 40;  // span of the frames' receive times
  std::size_t max_frames = 1500;
  std::size_t max_keyframes = 16;
  // Bytes of all packed keyframes: eight of 1080 lines. One keyframe stays in any case.
  std::size_t max_keyframe_bytes = std::size_t{10} << 20;
  std::size_t max_samples = 20000;  // of telemetry; without frames nothing else bounds their number
  // Telemetry is kept from this time before the first frame: the clock offset may be as large.
  double telemetry_margin_s = 2;
  double keyframes_apart = 0.3;  // least distance of two keyframes' directions, in fields of view
};

class CalibrationSession {
 public:
  explicit CalibrationSession(const SessionLimits& limits) : limits_(limits) {}

  // Forgets frames and images. Telemetry stays: it is of the same head.
  void clear();

  void add(const FrameTracks& tracks);
  // A sample with `restarted`, the first of a new connection, makes all earlier samples forgotten.
  void add(const PanTiltSample& sample);
  // Whether the head points where no image was taken yet. False without frames or telemetry.
  [[nodiscard]] bool wants_keyframe(const Camera<double>& camera) const;
  // Copies the image of the frame added last. Replaces the oldest image if there are max_keyframes,
  // and drops the oldest ones while they exceed max_keyframe_bytes. Needs a frame.
  void add_keyframe(const ImageView& image);

  [[nodiscard]] bool empty() const { return frames_.empty(); }
  // The number of the frame added last; empty: there is none.
  [[nodiscard]] std::optional<std::int64_t> newest_frame() const {
    return frames_.empty() ? std::nullopt : std::optional(frames_.back().stamp.frame);
  }
  [[nodiscard]] std::size_t frames() const { return frames_.size(); }
  // s, receive times of the frames: newest minus oldest, and the newest. 0 without frames.
  [[nodiscard]] double span_s() const;
  [[nodiscard]] double newest_s() const;

  // The range of telemetry's angles in the time of the frames; empty: there are none.
  [[nodiscard]] std::optional<AngleRange> angle_range() const;
  // width, height: of the image, px.
  [[nodiscard]] ViewCoverage coverage(int width, int height) const;

  // The frames' stamps, in order of arrival.
  [[nodiscard]] std::vector<FrameStamp> stamps() const;
  [[nodiscard]] std::vector<PanTiltSample> telemetry() const;
  [[nodiscard]] std::vector<CalibrationObservation> observations() const;

  // place: the frame's index among the stamps.
  [[nodiscard]] static bool is_held_out(std::size_t place);
  // Times of the frames that the result used, and of each held-out frame between two of them.
  [[nodiscard]] FrameTimes frame_times(const CalibrationResult& result) const;
  // The images of frames that have a time in the result.
  [[nodiscard]] std::vector<Keyframe> keyframes(const CalibrationResult& result) const;

 private:
  struct KeptFrame {
    FrameStamp stamp;
    std::vector<TrackedPoint> points;
  };
  struct KeptImage {
    std::int64_t frame;
    double receive_time_s;
    double pan, tilt;  // rad, measured, of the last sample before it
    std::shared_ptr<const PackedImage> image;
  };

  // Calls visit(time_s, angle) for each sample in the time of the frames; pan is continuous.
  template <class Visit>
  void visit_angles(const Visit& visit) const;

  SessionLimits limits_;
  std::deque<KeptFrame> frames_;
  std::deque<PanTiltSample> telemetry_;
  std::vector<KeptImage> images_;
  PanTilt<double> last_angle_;
};

}  // namespace alidade
