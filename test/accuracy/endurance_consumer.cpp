#include "test/accuracy/endurance_consumer.h"

#include <algorithm>
#include <cmath>

namespace alidade::test {

const StoredCalibration* MemoryArchive::find(std::optional<double> zoom) const {
  const StoredCalibration* nearest = nullptr;
  for (const auto& kept : kept_) {
    const std::optional<double>& of = kept->calibration.zoom;
    if (!zoom || !of) return kept.get();
    const double apart = std::abs(*of - *zoom);
    if (apart <= zoom_tolerance_ &&
        (nearest == nullptr || apart < std::abs(*nearest->calibration.zoom - *zoom))) {
      nearest = kept.get();
    }
  }
  return nearest;
}

bool MemoryArchive::save(const StoredCalibration& calibration, std::string*) {
  for (const auto& kept : kept_) {
    const auto& a = kept->calibration.zoom;
    const auto& b = calibration.calibration.zoom;
    if (a.has_value() == b.has_value() && (!a || std::abs(*a - *b) <= zoom_tolerance_)) {
      *kept = calibration;
      return true;
    }
  }
  kept_.push_back(std::make_unique<StoredCalibration>(calibration));
  return true;
}

EnduranceConsumer::EnduranceConsumer(const OrientationStepOptions& step,
                                     const std::optional<SelfCalibrationOptions>& calibrating)
    : calibration_(step.calibration),
      step_(step),
      width_(step.calibration.camera.width),
      height_(step.calibration.camera.height) {
  if (!calibrating) return;
  archive_ = std::make_unique<MemoryArchive>(calibrating->zoom_tolerance.value_or(0));
  calibrating_ = std::make_unique<SelfCalibration>(*calibrating, archive_.get());
}

void EnduranceConsumer::add(const PanTiltSample& sample) {
  step_.add_telemetry(sample);
  if (!calibrating_) return;
  waiting_.emplace_back(sample);
  calibrate(sample.latest_time_s);
}

Answer EnduranceConsumer::add(const FrameStamp& stamp, const ImageView& image) {
  StepEvents events;
  Answer answer;
  answer.record = step_.add_frame(stamp, image, &events);
  answer.record.calibration = report_;
  answer.calibration = calibration_;
  step_.maintain();
  if (events.video_clock_restarted) messages_.emplace_back("the video's clock began anew");
  if (events.video_delay_stepped) messages_.emplace_back("the least delay of the video stepped");
  if (!calibrating_) return answer;

  FeedFrame frame;
  step_.get_tracks(&frame.tracks);
  if (std::exchange(image_wanted_, false)) {
    frame.image.assign(image.luma, image.luma + width_ * height_);
  }
  waiting_.emplace_back(std::move(frame));
  calibrate(stamp.receive_time_s);
  return answer;
}

void EnduranceConsumer::telemetry_lost() {
  step_.telemetry_lost();
  if (calibrating_) waiting_.emplace_back(Loss::kTelemetry);
}

void EnduranceConsumer::video_lost(double now_s) {
  static_cast<void>(step_.video_lost(now_s));
  if (calibrating_) waiting_.emplace_back(Loss::kVideo);
}

void EnduranceConsumer::feed(const Feed& feed) {
  if (const auto* sample = std::get_if<PanTiltSample>(&feed)) {
    calibrating_->add(*sample);
  } else if (const auto* loss = std::get_if<Loss>(&feed)) {
    *loss == Loss::kVideo ? calibrating_->video_lost() : calibrating_->telemetry_lost();
  } else {
    const auto& frame = std::get<FeedFrame>(feed);
    calibrating_->add(frame.tracks);
    if (!frame.image.empty()) {
      calibrating_->add_keyframe(frame.tracks.stamp.frame,
                                 {frame.image.data(), width_, height_, width_});
    } else if (calibrating_->wants_keyframe()) {
      image_wanted_ = true;
    }
  }
}

void EnduranceConsumer::adopt(const PublishedCalibration& outcome) {
  step_.adopt(outcome);
  calibration_ = outcome.calibration;
  published_ += outcome.calibrated ? 1 : 0;
}

void EnduranceConsumer::calibrate(double now_s) {
  if (now_s < busy_until_s_) return;
  if (const auto outcome = std::exchange(outcome_, nullptr)) adopt(*outcome);
  for (; !waiting_.empty(); waiting_.pop_front()) feed(waiting_.front());
  const bool due = calibrating_->due();
  auto outcome = calibrating_->work();
  for (CalibrationMessage& message : calibrating_->take_messages())
    messages_.push_back(std::move(message.text));
  report_ = calibrating_->report();
  if (report_.activity != said_.activity || report_.need != said_.need) {
    messages_.push_back(std::string(to_string(report_.activity)) +
                        "; needs: " + to_string(report_.need));
    said_ = report_;
  }
  if (due) {
    report_.activity = CalibrationActivity::kAdjusting;
    busy_until_s_ = now_s + kAdjustingTime;
    outcome_ = std::move(outcome);
  } else if (outcome) {
    adopt(*outcome);
  }
}

std::vector<std::string> EnduranceConsumer::take_messages() { return std::exchange(messages_, {}); }

}  // namespace alidade::test
