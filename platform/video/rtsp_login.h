#pragma once
// RtspLogin: the Authorization header for a camera that has asked for a login: digest (RFC 2069
// with MD5, as cameras use it) or basic. Part of RtspSession. No I/O.

#include <gst/rtsp/gstrtspdefs.h>
#include <gst/rtsp/gstrtspmessage.h>

#include <string>

namespace alidade {

class RtspLogin {
 public:
  RtspLogin() = default;  // no login
  // challenge: basic or digest, from a camera's 401 answer.
  RtspLogin(const GstRTSPAuthCredential& challenge, const std::string& user,
            const std::string& password);

  // Value of the Authorization header; empty: none.
  [[nodiscard]] std::string header(GstRTSPMethod method, const std::string& url) const;

 private:
  GstRTSPAuthMethod scheme_ = GST_RTSP_AUTH_NONE;
  std::string user_;
  std::string password_;
  std::string realm_;
  std::string nonce_;
  std::string opaque_;
  bool has_opaque_ = false;
};

}  // namespace alidade
