#pragma once
// EnduranceConsumer: what `alidade run` does with the events of its links, on one thread and in their order,
// so that a virtual day takes as long as its pictures take to render.

#include <string>
#include <vector>

#include "edge_app/pipeline/orientation_step.h"

namespace alidade::test {

struct Answer {
  OrientationRecord record;
  Calibration calibration;  // in force for this record
  bool doubtful = false;    // what stands beside the record says that its calibration is in doubt
};

class EnduranceConsumer {
 public:
  explicit EnduranceConsumer(const OrientationStepOptions& options);

  void add(const PanTiltSample& sample);
  [[nodiscard]] Answer add(const FrameStamp& stamp, const ImageView& picture);
  void telemetry_lost();
  void video_lost(double now_s);

  // Of the log, since the last call.
  [[nodiscard]] std::vector<std::string> take_messages();

 private:
  OrientationStepOptions options_;
  OrientationStep step_;
  std::vector<std::string> messages_;
};

}  // namespace alidade::test
