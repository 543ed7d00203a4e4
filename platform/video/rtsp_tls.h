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

  // To be called before connecting. kFailed: *error is one line.
  [[nodiscard]] ReadStatus prepare(std::string* error);
  // To be called at the start of the handshake. The connection must not outlive this object.
  void judge(GTlsConnection* connection);

  // If the certificate was refused: the status, and *error is one line. kOk: not refused.
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
