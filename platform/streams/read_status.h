#pragma once

namespace alidade {

// The result of one read() of a source of frames or telemetry.
enum class ReadStatus {
  kOk,            // the item is valid
  kTimeout,       // nothing came within the given time; the connection is believed good
  kDisconnected,  // connection lost or refused; the next read() tries again; see error()
  kEnd,           // the recording has ended
  kStopped,       // stop() was called
  // Will never work (no such file, wrong password, unknown codec); see error(). A camera's answer
  // counts as this only before its first item; later it is kDisconnected.
  kFailed
};

}  // namespace alidade
