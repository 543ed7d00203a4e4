#pragma once
// RtspTls: certificate checks for RTSP over TLS (rtsps://). Part of RtspLink.

#include <gio/gio.h>

#include <atomic>
#include <memory>
#include <string>
#include <utility>

#include "platform/video/frame_source.h"

namespace alidade {

struct GObjectUnref {
  void operator()(void* object) const { g_object_unref(object); }
};

class RtspTls {
 public:
  // As RtpSourceOptions::certificate_file.
  explicit RtspTls(std::string certificate_file) : certificate_file_(std::move(certificate_file)) {}
  RtspTls(const RtspTls&) = delete;
  RtspTls& operator=(const RtspTls&) = delete;

  // To be called before each attempt to connect: loads the certificates and forgets the last
  // refusal. kFailed, with one line in *error: this machine has no TLS, or the file has no
  // certificate.
  [[nodiscard]] ReadStatus prepare(std::string* error);
  // To be called at the start of the handshake. The connection must not outlive this object.
  void judge(GTlsConnection* connection);

  // Whether the certificate was refused since prepare(), with one line in *error. kFailed: no known
  // authority signed it, or it is for another name. kDisconnected: any other fault, as it may come
  // from a clock of this machine that is not set yet. kOk: not refused.
  [[nodiscard]] ReadStatus refusal(std::string* error) const;

 private:
  static gboolean accept(GTlsConnection* tls, GTlsCertificate* certificate,
                         GTlsCertificateFlags faults, gpointer self);

  std::string certificate_file_;
  std::unique_ptr<GTlsDatabase, GObjectUnref> known_;  // the certificates of certificate_file_
  // GTlsCertificateFlags of the refused certificate. GLib calls accept() on a thread of its own.
  std::atomic<int> faults_{0};
};

}  // namespace alidade
