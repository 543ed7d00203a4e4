#include "platform/video/rtsp_tls.h"

namespace alidade {
namespace {

// Faults if no authority vouches for the certificate. The second comes if one of the same name has
// another key.
constexpr int kUnknownIssuer = G_TLS_CERTIFICATE_UNKNOWN_CA | G_TLS_CERTIFICATE_GENERIC_ERROR;

// What is wrong with a certificate, the worst fault first.
std::string fault_of(int faults, const std::string& file) {
  if ((faults & kUnknownIssuer) != 0) {
    return file.empty() ? "no authority that is known here has signed it"
                        : "it is neither in " + file + " nor signed by what is";
  }
  if ((faults & G_TLS_CERTIFICATE_BAD_IDENTITY) != 0) return "it is for another name";
  if ((faults & G_TLS_CERTIFICATE_EXPIRED) != 0) return "it has expired, by this machine's clock";
  if ((faults & G_TLS_CERTIFICATE_NOT_ACTIVATED) != 0) {
    return "it is not valid yet, by this machine's clock";
  }
  if ((faults & G_TLS_CERTIFICATE_REVOKED) != 0) return "it was revoked";
  return "it cannot be relied on";
}

}  // namespace

ReadStatus RtspTls::prepare(std::string* error) {
  if (g_tls_backend_supports_tls(g_tls_backend_get_default()) == FALSE) {
    *error = "this machine has no TLS for RTSP; install the package glib-networking";
    return ReadStatus::kFailed;
  }
  if (!certificate_file_.empty()) {
    GError* failure = nullptr;
    known_.reset(G_TLS_DATABASE(g_tls_file_database_new(certificate_file_.c_str(), &failure)));
    if (!known_) {
      *error = certificate_file_ + ": no certificates in PEM form: " + failure->message;
      g_error_free(failure);
      return ReadStatus::kFailed;
    }
  }
  faults_ = 0;
  return ReadStatus::kOk;
}

void RtspTls::judge(GTlsConnection* connection) {
  if (known_) g_tls_connection_set_database(connection, known_.get());
  g_signal_connect(connection, "accept-certificate", G_CALLBACK(&RtspTls::accept), this);
}

// Called for a certificate that GLib does not accept by itself.
gboolean RtspTls::accept(GTlsConnection* /*tls*/, GTlsCertificate* certificate,
                         GTlsCertificateFlags faults, gpointer self) {
  auto* tls = static_cast<RtspTls*>(self);
  const std::string& file = tls->certificate_file_;
  GList* own = file.empty() ? nullptr : g_tls_certificate_list_new_from_file(file.c_str(), nullptr);
  const bool is_own = g_list_find_custom(own, certificate, [](gconstpointer a, gconstpointer b) {
                        auto* one = static_cast<GTlsCertificate*>(const_cast<gpointer>(a));
                        auto* other = static_cast<GTlsCertificate*>(const_cast<gpointer>(b));
                        return g_tls_certificate_is_same(one, other) != FALSE ? 0 : 1;
                      }) != nullptr;
  g_list_free_full(own, &g_object_unref);
  if (!is_own) tls->faults_ = static_cast<int>(faults);
  return is_own ? TRUE : FALSE;
}

ReadStatus RtspTls::refusal(std::string* error) const {
  if (faults_ == 0) return ReadStatus::kOk;
  *error = "the camera's certificate is refused: " + fault_of(faults_, certificate_file_) +
           "; if it is the camera's, save it as a PEM file and set certificate_file";
  // Other faults may be due to a clock of this machine that is not set yet.
  constexpr int kForGood = kUnknownIssuer | G_TLS_CERTIFICATE_BAD_IDENTITY;
  return (faults_ & kForGood) != 0 ? ReadStatus::kFailed : ReadStatus::kDisconnected;
}

}  // namespace alidade
