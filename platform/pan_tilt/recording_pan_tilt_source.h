#pragma once
// RecordingPanTiltSource: the telemetry.csv of a recording (recording.h), at full speed or at the
// pace of its receive times. Without column earliest_time_s, a sample's interval is its receive
// time alone.

#include <memory>
#include <string>

#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct RecordingPanTiltSourceOptions {
  std::string directory;
  // Pace: the recording's first stamp (of frames and telemetry) is due at the first read().
  bool realtime = false;
};

class RecordingPanTiltSource : public PanTiltSource {
 public:
  explicit RecordingPanTiltSource(const RecordingPanTiltSourceOptions& options);
  ~RecordingPanTiltSource() override;
  RecordingPanTiltSource(const RecordingPanTiltSource&) = delete;
  RecordingPanTiltSource& operator=(const RecordingPanTiltSource&) = delete;

  [[nodiscard]] ReadStatus read(PanTiltSample& sample, double timeout_s) override;
  void stop() override;
  [[nodiscard]] std::string error() const override;
  [[nodiscard]] std::string name() const override;

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace alidade
