#include "test/accuracy/endurance_consumer.h"

#include <utility>

namespace alidade::test {

EnduranceConsumer::EnduranceConsumer(const OrientationStepOptions& options)
    : options_(options), step_(options) {}

void EnduranceConsumer::add(const PanTiltSample& sample) { step_.add_telemetry(sample); }

Answer EnduranceConsumer::add(const FrameStamp& stamp, const ImageView& picture) {
  StepEvents events;
  Answer answer;
  answer.record = step_.add_frame(stamp, picture, &events);
  answer.calibration = options_.calibration;
  step_.maintain();
  if (events.video_clock_restarted) messages_.emplace_back("video clock restarted");
  if (events.video_floor_shifted) messages_.emplace_back("least delay of the video stepped");
  return answer;
}

void EnduranceConsumer::telemetry_lost() { step_.telemetry_lost(); }

void EnduranceConsumer::video_lost(double now_s) { static_cast<void>(step_.video_lost(now_s)); }

std::vector<std::string> EnduranceConsumer::take_messages() { return std::exchange(messages_, {}); }

}  // namespace alidade::test
