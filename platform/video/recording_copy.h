#pragma once
// RecordingCopy: stores live streams as a recording (recording.h): the pictures unchanged in
// video.mkv, their stamps and the telemetry in the tables. The source must keep its stream
// (FrameSource::keep_stream()). The recording begins with the first picture at which decoding can
// begin, and with the telemetry of shortly before. Frames are given by one thread and samples by
// one; the counts are for any thread.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>

#include "platform/storage/recording_writer.h"
#include "platform/streams/frame.h"
#include "platform/streams/pan_tilt_sample.h"

namespace alidade {

class StreamCopy;

class RecordingCopy {
 public:
  // Of telemetry from before the first stored frame, so many samples are stored.
  static constexpr std::size_t kEarlySamples = 256;

  // Creates nothing yet. directory: of this recording alone.
  explicit RecordingCopy(std::string directory);
  ~RecordingCopy();
  RecordingCopy(const RecordingCopy&) = delete;
  RecordingCopy& operator=(const RecordingCopy&) = delete;

  // Why the frame cannot be part of this recording, such as another size. One line; empty: it can.
  [[nodiscard]] std::string fault_of(const Frame& frame) const;

  // Stores a frame without fault under the next number. Left out, and counted once
  // the recording has begun: a frame without Frame::coded. Left out, too: those before the first at
  // which decoding can begin. False with one line in
  // *error: it could not be written.
  [[nodiscard]] bool add(const Frame& frame, std::string* error);
  // Before the first stored frame, the newest samples are kept in memory. False: likewise.
  [[nodiscard]] bool add(const PanTiltSample& sample, std::string* error);

  // The thread of the frames: some were lost, and counted, before the next one. Those that need a
  // picture from before the loss are left out.
  void go_on_after_loss(std::int64_t lost);

  // Waits until the tables are on the disk. Not while frames or samples are added.
  [[nodiscard]] bool flush(std::string* error);

  [[nodiscard]] std::int64_t frames() const { return frames_; }      // stored
  [[nodiscard]] std::int64_t samples() const { return samples_; }    // stored
  [[nodiscard]] std::int64_t left_out() const { return left_out_; }  // frames
  // s; from the first stored frame to the last, and one period of the frames. 0 before the second.
  [[nodiscard]] double length_s() const;

 private:
  const std::string directory_;
  const std::unique_ptr<StreamCopy> video_;
  RecordingWriter tables_;
  std::atomic<bool> open_{false};    // the tables are
  bool restarted_ = false;           // a frame that was left out began a new connection
  bool gap_ = false;                 // since a loss no picture has come that needs none before it
  std::deque<PanTiltSample> early_;  // until the tables are open
  std::atomic<std::int64_t> frames_{0};
  std::atomic<std::int64_t> samples_{0};
  std::atomic<std::int64_t> left_out_{0};
  std::atomic<double> first_receive_s_{0};
  std::atomic<double> last_receive_s_{0};
};

}  // namespace alidade
