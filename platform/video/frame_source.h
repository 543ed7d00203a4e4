#pragma once
// FrameSource: one interface for all sources of video frames (RTSP, RTP, MJPEG over HTTP, V4L2,
// recordings). A source owns its connection: opens it, detects its loss, and reopens it with
// back-off. read() blocks only the calling (capture) thread. stop() may be called from any other
// thread and makes a blocked read() return soon. Not for the real-time thread: read() allocates and
// waits.

#include <cstdint>
#include <string>

#include "platform/streams/frame.h"
#include "platform/streams/read_status.h"

namespace alidade {

// Counts of what a source received but could not deliver.
struct FrameSourceCounters {
  std::int64_t damaged = 0;          // frames that were incomplete or could not be decoded
  std::int64_t dropped = 0;          // frames that read() did not fetch in time
  std::int64_t unstamped = 0;        // frames whose time stamp cannot be true: they get none
  std::int64_t foreign_packets = 0;  // packets that are not of the agreed session
  std::int64_t garbage_bytes = 0;    // bytes that belong to no packet
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // Waits at most timeout_s for the next frame. Fills frame only on kOk.
  [[nodiscard]] virtual ReadStatus read(Frame& frame, double timeout_s) = 0;

  // Called on the reading thread: the frame just delivered cannot be used, for this reason. True:
  // the source closes the connection, read() reports kDisconnected with the reason, and the source
  // reconnects after a growing pause. False: the source has no connection to close.
  [[nodiscard]] virtual bool refuse(const std::string& /*reason*/) { return false; }

  // Thread-safe. Whether the next frames hold their pictures as the stream carries them
  // (Frame::coded). At first they do not. False: this source is no live stream, and they never do.
  virtual bool keep_stream(bool /*keep*/) { return false; }

  // Thread-safe, idempotent. Every later read() returns kStopped.
  virtual void stop() = 0;

  // One line for the user: what failed, where (URL without password), what would be right. Valid
  // after read() returned kDisconnected or kFailed; for the reading thread.
  [[nodiscard]] virtual std::string error() const = 0;

  // URL without password, device path or directory.
  [[nodiscard]] virtual std::string name() const = 0;

  // One line for the user: what is awaited on an open connection, since when, and how to shorten
  // the wait. Empty: nothing is awaited, or not for long yet (RTP: 3 s). Thread-safe.
  [[nodiscard]] virtual std::string waiting() const { return ""; }

  // One line for the user: a fault of a stream whose pictures do come, and how the fault was
  // handled. Each kind is reported once. Empty: nothing new. Thread-safe.
  [[nodiscard]] virtual std::string remark() { return ""; }

  // Since the source was created; thread-safe. Zeros if the source does not count.
  [[nodiscard]] virtual FrameSourceCounters counters() const { return {}; }
};

}  // namespace alidade
