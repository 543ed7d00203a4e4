#pragma once
// FrameSource: one interface for every origin of video frames (RTSP, RTP, MJPEG over HTTP, V4L2,
// recording).
//
// A source owns its connection: it opens it, notices its loss, and opens it again with back-off.
// read() blocks on the calling (capture) thread only; stop() may be called from any other thread
// and makes a blocked read() return soon. Not for the real-time thread: read() allocates and waits.

#include <cstdint>
#include <string>

#include "platform/streams/frame.h"
#include "platform/streams/read_status.h"

namespace alidade {

// What a source that receives and decodes on its own could not deliver.
struct FrameSourceCounters {
  std::int64_t damaged = 0;          // frames that were incomplete or not decodable
  std::int64_t dropped = 0;          // frames that read() did not fetch in time
  std::int64_t unstamped = 0;        // frames whose time stamp cannot be true: they have none
  std::int64_t foreign_packets = 0;  // that the session has not agreed upon
  std::int64_t garbage_bytes = 0;    // that belong to no packet
};

class FrameSource {
 public:
  virtual ~FrameSource() = default;

  // Waits at most timeout_s for the next frame. Fills frame only on kOk.
  [[nodiscard]] virtual ReadStatus read(Frame& frame, double timeout_s) = 0;

  // From the reading thread: the frame that read() has just given cannot be used, for this reason. True: the connection is
  // given up, read() reports it as kDisconnected with the reason, and it is tried again after a growing pause. False: this
  // source has none to give up.
  [[nodiscard]] virtual bool refuse(const std::string& /*reason*/) { return false; }

  // Thread-safe, idempotent. Every later read() returns kStopped.
  virtual void stop() = 0;

  // One line for the person: what failed, where (URL without password), what would be right.
  // Valid after read() returned kDisconnected or kFailed; called from the reading thread.
  [[nodiscard]] virtual std::string error() const = 0;

  // URL without password, device or directory.
  [[nodiscard]] virtual std::string name() const = 0;

  // One line for the person: what is waited for though the connection stands, since when, and what would shorten it. Empty:
  // nothing, or not for long. Thread-safe.
  [[nodiscard]] virtual std::string waiting() const { return ""; }

  // One line for the person: what is wrong with the stream though its pictures come, and what was done about it. Each kind
  // once; empty: nothing new. Thread-safe.
  [[nodiscard]] virtual std::string remark() { return ""; }

  // Since the source was made; thread-safe. Zeros where the source does not count.
  [[nodiscard]] virtual FrameSourceCounters counters() const { return {}; }
};

}  // namespace alidade
