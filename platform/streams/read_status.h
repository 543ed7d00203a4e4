#pragma once

namespace alidade {

// What one read() of a source of frames or telemetry came to.
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

}  // namespace alidade
