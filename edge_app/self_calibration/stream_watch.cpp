#include "edge_app/self_calibration/stream_watch.h"

#include <algorithm>

namespace alidade {

void StreamWatch::add(const FrameTracks& tracks) {
  last_frame_s_ = tracks.stamp.receive_time_s;
  now_s_ = std::max(now_s_, last_frame_s_);
  video_is_lost_ = false;
  telemetry_is_old_ = old_telemetry_.judge(now_s_, tracks.telemetry_too_old);
  static_cast<void>(repeated_.judge(now_s_, tracks.image_repeated));
}

double StreamWatch::repeated_share() const {
  if (repeated_.frames() < kRepeated.least_frames) return 0;
  return static_cast<double>(repeated_.contradicted_frames()) /
         static_cast<double>(repeated_.frames());
}

void StreamWatch::add(const PanTiltSample& sample) {
  last_sample_s_ = sample.latest_time_s;
  now_s_ = std::max(now_s_, last_sample_s_);
  telemetry_is_lost_ = false;
}

bool StreamWatch::judge_delay(const FrameTracks& tracks) {
  constexpr double kSteady = 0.5;  // of the limit: wander fades slowly
  const double most_s = schedule_.most_wander_s;
  const bool wanders = tracks.delay_wander_s > (delay_wanders_ ? kSteady * most_s : most_s);
  const bool changed = wanders != delay_wanders_;
  delay_wanders_ = wanders;
  return changed;
}

std::optional<CalibrationNeed> StreamWatch::unsteady() const {
  if (video_is_lost_) return std::nullopt;
  if (telemetry_is_old_ && !telemetry_is_lost_) return CalibrationNeed::kYoungTelemetry;
  if (delay_wanders_) return CalibrationNeed::kSteadyDelay;
  return std::nullopt;
}

std::optional<CalibrationNeed> StreamWatch::missing() const {
  const double since_s = now_s_ - schedule_.silence_s;
  if (video_is_lost_ || last_frame_s_ < since_s) return CalibrationNeed::kVideo;
  if (telemetry_is_lost_ || last_sample_s_ < since_s) return CalibrationNeed::kTelemetry;
  return std::nullopt;
}

}  // namespace alidade
