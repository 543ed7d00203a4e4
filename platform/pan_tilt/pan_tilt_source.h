#pragma once
// PanTiltSource: one interface for all sources of pan/tilt telemetry (Axis VAPIX, ONVIF, heads on
// serial lines, recordings). Like a FrameSource, it reconnects by itself. read() blocks only its
// own thread; stop() ends it.

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

  // One line for the user; valid after kDisconnected and kFailed.
  [[nodiscard]] virtual std::string error() const = 0;

  // For the reading thread: the notes since the last call. A note is one line: how the device
  // deviates from its protocol, and how this is handled. Each comes once in the source's life.
  [[nodiscard]] virtual std::vector<std::string> take_notes() { return {}; }

  // URL without password, device path or directory.
  [[nodiscard]] virtual std::string name() const = 0;
};

}  // namespace alidade
