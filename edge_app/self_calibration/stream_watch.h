#pragma once
// StreamWatch: are frames and telemetry good enough to calibrate a camera with them? Neither may be
// lost or silent; the video's delay must be steady, telemetry young enough for the frames, and
// pictures may not be repeated.
// Seconds of the host's clock. Allocates little. One thread.

#include <optional>

#include "edge_app/record/published_calibration.h"
#include "edge_app/self_calibration/calibration_schedule.h"
#include "edge_app/self_calibration/calibration_watch.h"
#include "edge_app/step/calibration_feed.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

class StreamWatch {
 public:
  explicit StreamWatch(const CalibrationSchedule& schedule) : schedule_(schedule) {}

  void add(const FrameTracks& tracks);
  void add(const PanTiltSample& sample);
  // The stream is lost.
  void lose_video() { video_is_lost_ = true; }          // until the next frame
  void lose_telemetry() { telemetry_is_lost_ = true; }  // until the next sample

  // Judges the delay by this frame. True if the delay has begun or ceased to wander.
  [[nodiscard]] bool judge_delay(const FrameTracks& tracks);
  [[nodiscard]] bool delay_wanders() const { return delay_wanders_; }

  // Share of the latest frames whose picture was sent again, 0 to 1.
  [[nodiscard]] double repeated_share() const;

  // s, the latest receive time of a frame or sample.
  [[nodiscard]] double now_s() const { return now_s_; }
  // What must improve before anything is calibrated or withdrawn; empty: nothing.
  [[nodiscard]] std::optional<CalibrationNeed> unsteady() const;
  // The stream that does not come; empty: both come.
  [[nodiscard]] std::optional<CalibrationNeed> missing() const;

 private:
  // Half of the frames of 2 s, as record_fields.yaml says of `needs`.
  static constexpr DisagreementOptions kOldTelemetry = {/*span_s=*/2, /*share=*/0.5,
                                                        /*least_frames=*/5};

  // Only the counts are used: as long as a session's frames.
  static constexpr DisagreementOptions kRepeated = {/*span_s=*/40, /*share=*/1,
                                                    /*least_frames=*/20};

  CalibrationSchedule schedule_;
  double now_s_ = 0;
  double last_frame_s_ = 0;
  double last_sample_s_ = 0;
  bool video_is_lost_ = false;
  bool telemetry_is_lost_ = false;
  bool delay_wanders_ = false;
  DisagreementJudge old_telemetry_{kOldTelemetry};
  bool telemetry_is_old_ = false;
  DisagreementJudge repeated_{kRepeated};
};

}  // namespace alidade
