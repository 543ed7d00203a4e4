#pragma once
// PanTiltSource: one interface for every origin of pan/tilt telemetry (Axis VAPIX, ONVIF, heads on
// serial lines, recording). Like FrameSource, a source reconnects by itself; read() blocks its own
// thread only, stop() ends it.

#include <string>
#include <vector>

#include "platform/streams/pan_tilt_sample.h"
#include "platform/streams/read_status.h"

namespace alidade {

class PanTiltSource {
 public:
  virtual ~PanTiltSource() = default;

  // Waits at most timeout_s for the next sample; a polling source paces itself. Fills sample on
  // kOk.
  [[nodiscard]] virtual ReadStatus read(PanTiltSample& sample, double timeout_s) = 0;

  // Thread-safe, idempotent. Every later read() returns kStopped.
  virtual void stop() = 0;

  // One line for the person; valid after kDisconnected or kFailed.
  [[nodiscard]] virtual std::string error() const = 0;

  // What the device does otherwise than its protocol says, and what is made of it: lines for the
  // person, each said once in the source's life. Those since the last call, from the reading
  // thread.
  [[nodiscard]] virtual std::vector<std::string> take_notes() { return {}; }

  // URL without password, device or directory.
  [[nodiscard]] virtual std::string name() const = 0;
};

}  // namespace alidade
