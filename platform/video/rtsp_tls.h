#pragma once
// RtspTls: what RTSP over TLS (rtsps://) asks of a connection, beside RTSP itself: whose certificate is trusted. Part of
// RtspLink.

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

  // Before a connection is made. kFailed: *error is one line.
  [[nodiscard]] ReadStatus prepare(std::string* error);
  // As its greeting begins. It must not outlive this object.
  void judge(GTlsConnection* connection);

  // Why it could not connect, if the certificate was refused: then *error is one line. kOk: it was not.
  [[nodiscard]] ReadStatus refusal(std::string* error) const;

 private:
  static gboolean accept(GTlsConnection* tls, GTlsCertificate* certificate,
                         GTlsCertificateFlags faults, gpointer self);

  std::string certificate_file_;
  std::unique_ptr<GTlsDatabase, GObjectUnref> known_;  // what is in it
  // GTlsCertificateFlags of the certificate that was refused. GLib asks on a thread of its own.
  std::atomic<int> faults_{0};
};

}  // namespace alidade
