#pragma once
// FrameSource: one interface for every origin of video frames (RTSP, RTP, MJPEG over HTTP, V4L2,
// recording).
//
// A source owns its connection: it opens it, notices its loss, and opens it again with back-off.
// read() blocks on the calling (capture) thread only; stop() may be called from any other thread
// and makes a blocked read() return soon. Times are seconds of the host's CLOCK_MONOTONIC, taken
// when the frame arrived, never after decoding. Not for the real-time thread: read() allocates and waits.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

namespace alidade {

// When and in which order a frame came. Fixed size: crosses queues by value.
struct FrameStamp {
  std::int64_t frame = 0;  // 0, 1, 2, ... of the frames this source delivered
  // host CLOCK_MONOTONIC at the arrival of the frame's last packet (of its first byte, or as the driver
  // stamped it, where the source says so)
  double receive_time_s = 0;
  std::optional<double> sender_time_s;   // capture time on the sender's clock, unwrapped, any epoch
  std::optional<double> sender_utc_s;    // the same as Unix time, once RTCP or the like has told it
  std::optional<std::int64_t> sequence;  // sender's count of frames, unwrapped; a gap is a loss
  bool restarted =
      false;  // first frame after a (re)connection: sender clock and sequence begin anew
};

// One frame: its stamp and, if decoded, its luma plane.
struct Frame {
  FrameStamp stamp;
  int width = 0;   // px
  int height = 0;  // px
  // 8-bit luma, row v starts at luma + v * stride; null if the source was told not to decode.
  const std::uint8_t* luma = nullptr;
  std::ptrdiff_t stride = 0;          // bytes
  std::shared_ptr<const void> owner;  // keeps luma alive
  // What read() took to make luma of the data, waiting and queueing not included; none: not decoded,
  // or not told.
  std::optional<double> decode_s;
};

enum class ReadStatus {
  kOk,            // the item is valid
  kTimeout,       // nothing came within the time given; the connection is believed good
  kDisconnected,  // connection lost or refused; the next read() tries again; see error()
  kEnd,           // a recording is over
  kStopped,       // stop() was called
  // Will never work (no such file, wrong password, unknown codec); see error(). What a camera answers counts so
  // only until its first item: later it is kDisconnected.
  kFailed
};

// What a source that receives and decodes on its own could not deliver.
struct FrameSourceCounters {
  std::int64_t damaged = 0;  // frames that were incomplete or not decodable
  std::int64_t dropped = 0;  // frames that read() did not fetch in time
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // Waits at most timeout_s for the next frame. Fills frame only on kOk.
  [[nodiscard]] virtual ReadStatus read(Frame& frame, double timeout_s) = 0;

  // Thread-safe, idempotent. Every later read() returns kStopped.
  virtual void stop() = 0;

  // One line for the person: what failed, where (URL without password), what would be right.
  // Valid after read() returned kDisconnected or kFailed; called from the reading thread.
  [[nodiscard]] virtual std::string error() const = 0;

  // URL without password, device or directory.
  [[nodiscard]] virtual std::string name() const = 0;

  // Since the source was made; thread-safe. Zeros where the source does not count.
  [[nodiscard]] virtual FrameSourceCounters counters() const { return {}; }
};

}  // namespace alidade
