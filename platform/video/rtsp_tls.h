#pragma once
// RtspTls: what RTSP over TLS (rtsps://) asks of a connection of GStreamer's RTSP library, beside RTSP itself: whose
// certificate is trusted, and what waits within TLS. Part of RtspSession.

#include <gst/rtsp/gstrtspconnection.h>

#include <atomic>
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

  // Before it connects; the connection must not do that after this object's end. kFailed: *error is one line.
  [[nodiscard]] ReadStatus prepare(GstRTSPConnection* connection, std::string* error);

  // Why it could not connect, if the certificate was refused: then *error is one line. kOk: it was not.
  [[nodiscard]] ReadStatus refusal(std::string* error) const;

 private:
  static gboolean accept(GTlsConnection* tls, GTlsCertificate* certificate,
                         GTlsCertificateFlags faults, gpointer self);

  std::string certificate_file_;
  // GTlsCertificateFlags of the certificate that was refused. GLib asks on a thread of its own.
  std::atomic<int> faults_{0};
};

}  // namespace alidade
