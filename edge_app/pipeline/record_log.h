#pragma once
// RecordLog: logs what is remarkable about records and the events that come with them: old
// telemetry, clocks, the delay of the links, repeated images, full queues. An event that every
// record may have is logged rarely. For the output thread.

#include "edge_app/pipeline/realtime_stage.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/video/frame_source.h"

namespace alidade {

class RecordLog {
 public:
  // Borrows the sources, for their names.
  RecordLog(const FrameSource& video, const PanTiltSource& pan_tilt,
            const OrientationStepOptions& options)
      : video_(video),
        pan_tilt_(pan_tilt),
        max_extrapolation_s_(options.telemetry_limits.max_extrapolation_s),
        video_stamp_sigma_s_(options.video_stamp_sigma_s) {}

  // drops: so far.
  void add(const OutputMessage& message, const DropCounters& drops);

 private:
  // True at most once in each interval; asked only if there is something to log.
  struct Rarely {
    double interval_s;
    double last_s = -1e9;
    [[nodiscard]] bool is_due();
  };

  void log_old_telemetry(const OrientationRecord& record);
  void log_clock(const OutputMessage& message);
  void log_delay(const OutputMessage& message);
  void log_repeated(const OrientationRecord& record);
  void log_drops(const DropCounters& drops);

  const FrameSource& video_;
  const PanTiltSource& pan_tilt_;
  const double max_extrapolation_s_;
  const double video_stamp_sigma_s_;
  Rarely old_telemetry_{60};
  Rarely wander_{60};
  Rarely repeated_{600};
  Rarely drops_{1};
  DropCounters drops_logged_;
};

}  // namespace alidade
