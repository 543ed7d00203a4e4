#include "platform/video/recording_copy.h"

#include <filesystem>
#include <utility>

#include "platform/video/stream_copy.h"

namespace alidade {

RecordingCopy::RecordingCopy(std::string directory)
    : directory_(std::move(directory)),
      video_(std::make_unique<StreamCopy>(
          (std::filesystem::path(directory_) / "video.mkv").string())) {}
RecordingCopy::~RecordingCopy() = default;

std::string RecordingCopy::fault_of(const Frame& frame) const {
  return frame.coded ? video_->fault_of(*frame.coded) : "";
}

bool RecordingCopy::add(const Frame& frame, std::string* error) {
  if (frame.coded && (frame.coded->packet->flags & AV_PKT_FLAG_KEY) != 0) gap_ = false;
  if (!frame.coded || gap_ || (!open_ && !frame.coded->begins)) {
    if (open_) ++left_out_;
    restarted_ = restarted_ || frame.stamp.restarted;
    return true;
  }
  if (!open_ && !tables_.open(directory_, frame.width, frame.height, "", error)) return false;
  open_ = true;
  FrameStamp stamp = frame.stamp;
  stamp.frame = frames_;
  stamp.restarted = std::exchange(restarted_, false) || stamp.restarted;
  if (!video_->add(*frame.coded, stamp.receive_time_s, error)) return false;
  if (!tables_.add_frame(stamp, error)) return false;
  if (frames_ == 0) first_receive_s_ = stamp.receive_time_s;
  last_receive_s_ = stamp.receive_time_s;
  ++frames_;
  return true;
}

bool RecordingCopy::add(const PanTiltSample& sample, std::string* error) {
  early_.push_back(sample);
  if (early_.size() > kEarlySamples) early_.pop_front();
  for (; open_ && !early_.empty(); early_.pop_front()) {
    if (!tables_.add_telemetry(early_.front(), error)) return false;
    ++samples_;
  }
  return true;
}

void RecordingCopy::go_on_after_loss(std::int64_t lost) {
  left_out_ += lost;
  gap_ = gap_ || lost > 0;
}

bool RecordingCopy::flush(std::string* error) { return !open_ || tables_.flush(error); }

double RecordingCopy::length_s() const {
  const auto frames = static_cast<double>(frames_.load());
  return frames > 1 ? (last_receive_s_ - first_receive_s_) * frames / (frames - 1) : 0;
}

}  // namespace alidade
