#include "platform/pan_tilt/recording_pan_tilt_source.h"

#include <vector>

#include "platform/storage/playback.h"
#include "platform/storage/recording.h"

namespace alidade {

class RecordingPanTiltSource::Implementation {
 public:
  explicit Implementation(const RecordingPanTiltSourceOptions& options)
      : directory_(options.directory), playback_(options.directory, options.realtime) {}

  ReadStatus read(PanTiltSample& sample, double timeout_s) {
    if (playback_.stopped()) {
      return ReadStatus::kStopped;
    }
    if (!loaded_) {
      failed_ = !read_telemetry_csv(directory_, &samples_, &error_);
      loaded_ = true;
    }
    if (failed_) {
      return ReadStatus::kFailed;
    }
    if (next_ == samples_.size()) {
      return ReadStatus::kEnd;
    }
    const ReadStatus status = playback_.wait_until_due(samples_[next_].latest_time_s, timeout_s);
    if (status == ReadStatus::kOk) {
      sample = samples_[next_++];
    }
    return status;
  }

  void stop() { playback_.stop(); }
  const std::string& error() const { return error_; }
  const std::string& name() const { return directory_; }

 private:
  std::string directory_;
  Playback playback_;
  bool loaded_ = false;
  bool failed_ = false;
  std::string error_;
  std::vector<PanTiltSample> samples_;
  std::size_t next_ = 0;
};

RecordingPanTiltSource::RecordingPanTiltSource(const RecordingPanTiltSourceOptions& options)
    : implementation_(std::make_unique<Implementation>(options)) {}
RecordingPanTiltSource::~RecordingPanTiltSource() = default;
ReadStatus RecordingPanTiltSource::read(PanTiltSample& sample, double timeout_s) {
  return implementation_->read(sample, timeout_s);
}
void RecordingPanTiltSource::stop() { implementation_->stop(); }
std::string RecordingPanTiltSource::error() const { return implementation_->error(); }
std::string RecordingPanTiltSource::name() const { return implementation_->name(); }

}  // namespace alidade
