#pragma once
// ZoomDay: what the links of the virtual camera bring while its lens zooms, in the order in which a host hears of it, for a camera that
// is known by its data sheet alone: dwells at three zooms, the third between the others, then movements at random.
//
// The lens of alidade_zoom_sweep: 20x, repeatability 0.2 %, backlash, a wandering optical centre; line delay -14.2 us, noise of 2 grey
// levels, JPEG of quality 85, telemetry of 50 urad in steps of 0.001 degrees. The camera turns by parts of its field of view, at random,
// sometimes hardly.
// Times: true time counts from 0. Host time (all stamps) is true time plus kHostEpoch; a frame is received kLatency after its row 0 and
// later, its sender's clock is skewed; telemetry is polled, angles and zoom were true between request and answer.
// Everything follows from the plan. image() may be called by several threads.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/model/calibration.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/video/frame_source.h"
#include "test/accuracy/kept_frames.h"
#include "test/support/temporary_directory.h"
#include "test/support/zooming_camera.h"

namespace alidade::test {

struct ZoomDayPlan {
  std::uint64_t seed = 1;
  int width = 480;  // px, of 16:9; focal lengths are 1200 to 24,000 px of 1280
  double rate_hz = 25;
  double first_rest_s = 20;  // at the first zoom
  double rest_s = 14;        // at the second and third
  int movements = 0;         // after these
  double movements_s = 0;    // in which they are made, with rests between
  std::string cache;         // folder where rendered frames are kept; empty: nowhere
};

class ZoomDay {
 public:
  static constexpr double kHostEpoch = 1000;  // s
  static constexpr double kLatency = 45e-3;   // s

  explicit ZoomDay(const ZoomDayPlan& plan);

  struct Event {
    bool is_frame = false;
    double host_time_s = 0;
    std::size_t index = 0;  // of frames() or samples()
  };
  [[nodiscard]] const std::vector<Event>& events() const { return events_; }
  [[nodiscard]] const std::vector<FrameStamp>& frames() const { return frames_; }
  [[nodiscard]] const std::vector<PanTiltSample>& samples() const { return samples_; }
  // As it comes out of the camera's coder and a decoder, row after row.
  [[nodiscard]] std::vector<std::uint8_t> image(std::size_t frame) const;

  // Truth.
  [[nodiscard]] const ZoomingCamera& camera() const { return *camera_; }
  [[nodiscard]] double telemetry_sigma() const;  // rad
  // When the lens stands; the first begins at 0.
  struct Rest {
    double from_s = 0;
    double to_s = 0;
    double focal_length = 0;  // px, as if it came back exactly
  };
  [[nodiscard]] const std::vector<Rest>& rests() const { return rests_; }
  // The rest during all of whose rows the lens stands, or -1: it moves.
  [[nodiscard]] int rest_of(std::size_t frame) const;
  // Which says both ends of the focal length, and nothing of lens and axes.
  [[nodiscard]] Calibration data_sheet() const;

 private:
  void make_frames();
  void make_samples();

  ZoomDayPlan plan_;
  TemporaryDirectory directory_;  // of the zoom's path
  simulator::Config config_;
  std::vector<Rest> rests_;
  std::unique_ptr<ZoomingCamera> camera_;
  std::optional<KeptFrames> kept_;
  std::vector<Event> events_;
  std::vector<FrameStamp> frames_;
  std::vector<PanTiltSample> samples_;
};

}  // namespace alidade::test
