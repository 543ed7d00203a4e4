#pragma once
// RtspLogin: the header by which a request logs in, once a camera has asked for it: digest (RFC 2069, MD5, as cameras have it)
// or basic. Part of RtspSession. No I/O.

#include <gst/rtsp/gstrtspdefs.h>
#include <gst/rtsp/gstrtspmessage.h>

#include <string>

namespace alidade {

class RtspLogin {
 public:
  RtspLogin() = default;  // none
  // challenge: basic or digest, as a camera's answer 401 has it.
  RtspLogin(const GstRTSPAuthCredential& challenge, const std::string& user,
            const std::string& password);

  // The value of Authorization; empty: none.
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
