#include "platform/pan_tilt/recording_pan_tilt_source.h"

#include <vector>

#include "platform/storage/playback.h"
#include "platform/storage/recording.h"

namespace alidade {

namespace {

class RecordingPanTiltSource : public PanTiltSource {
 public:
  explicit RecordingPanTiltSource(const RecordingPanTiltSourceOptions& options)
      : directory_(options.directory), playback_(options.directory, options.realtime) {}

  ReadStatus read(PanTiltSample& sample, double timeout_s) override {
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

  void stop() override { playback_.stop(); }
  std::string error() const override { return error_; }
  std::string name() const override { return directory_; }

 private:
  std::string directory_;
  Playback playback_;
  bool loaded_ = false;
  bool failed_ = false;
  std::string error_;
  std::vector<PanTiltSample> samples_;
  std::size_t next_ = 0;
};

}  // namespace

std::unique_ptr<PanTiltSource> open_recorded_pan_tilt(
    const RecordingPanTiltSourceOptions& options) {
  return std::make_unique<RecordingPanTiltSource>(options);
}

}  // namespace alidade
