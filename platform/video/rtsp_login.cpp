#include "platform/video/rtsp_login.h"

#include <memory>

namespace alidade {
namespace {

struct FreeGText {
  void operator()(gchar* text) const { g_free(text); }
};
using GText = std::unique_ptr<gchar, FreeGText>;

// As a quoted string (RFC 7230, 3.2.6).
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char each : text) {
    if (each == '"' || each == '\\') out += '\\';
    out += each;
  }
  return out + "\"";
}

}  // namespace

RtspLogin::RtspLogin(const GstRTSPAuthCredential& challenge, const std::string& user,
                     const std::string& password)
    : scheme_(challenge.scheme), user_(user), password_(password) {
  for (GstRTSPAuthParam** each = challenge.params; each != nullptr && *each != nullptr; ++each) {
    const std::string value = (*each)->value == nullptr ? "" : (*each)->value;
    if (g_ascii_strcasecmp((*each)->name, "realm") == 0) realm_ = value;
    if (g_ascii_strcasecmp((*each)->name, "nonce") == 0) nonce_ = value;
    if (g_ascii_strcasecmp((*each)->name, "opaque") == 0) {
      opaque_ = value;
      has_opaque_ = true;
    }
  }
}

std::string RtspLogin::header(GstRTSPMethod method, const std::string& url) const {
  if (scheme_ == GST_RTSP_AUTH_BASIC) {
    const std::string both = user_ + ":" + password_;
    const GText coded(g_base64_encode(reinterpret_cast<const guchar*>(both.data()), both.size()));
    return std::string("Basic ") + coded.get();
  }
  if (scheme_ != GST_RTSP_AUTH_DIGEST) return "";
  const GText response(gst_rtsp_generate_digest_auth_response(
      nullptr, gst_rtsp_method_as_text(method), realm_.c_str(), user_.c_str(), password_.c_str(),
      url.c_str(), nonce_.c_str()));
  if (!response) return "";
  // The camera's values are returned unchanged.
  std::string all = "Digest username=" + quoted(user_) + ", realm=\"" + realm_ + "\", nonce=\"" +
                    nonce_ + "\", uri=\"" + url + "\", response=\"" + response.get() + "\"";
  if (has_opaque_) all += ", opaque=\"" + opaque_ + "\"";
  return all;
}

}  // namespace alidade
