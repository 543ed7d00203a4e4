#include "edge_app/output/http/http_tls.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <openssl/err.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>
#include <spdlog/spdlog.h>

#include <ctime>
#include <utility>

#include "platform/system/whole_file.h"

namespace alidade {
namespace {

constexpr double kLookAtFilesAgainS = 1;

template <auto kFree>
struct Free {
  template <class T>
  void operator()(T* object) const {
    kFree(object);
  }
};
using Bio = std::unique_ptr<BIO, Free<&BIO_free>>;
using Certificate = std::unique_ptr<X509, Free<&X509_free>>;
using Key = std::unique_ptr<EVP_PKEY, Free<&EVP_PKEY_free>>;

// Without it the library would ask for a password at the terminal.
int has_no_password(char* /*buffer*/, int /*size*/, int /*writing*/, void* asked) {
  if (asked != nullptr) *static_cast<bool*>(asked) = true;
  return -1;
}

Bio memory_of(const std::string& text) {
  return Bio(BIO_new_mem_buf(text.data(), static_cast<int>(text.size())));
}

std::string library_says() {
  const char* const reason = ERR_reason_error_string(ERR_peek_last_error());
  return reason == nullptr ? "unknown failure" : reason;
}

std::string day_of(const ASN1_TIME* time) {
  std::tm parts{};
  return ASN1_TIME_to_tm(time, &parts) == 1 ? fmt::format("{:%Y-%m-%d}", parts) : "an unknown day";
}

void check_validity(const X509* certificate, const std::string& file,
                    std::vector<std::string>* warnings) {
  const ASN1_TIME* const from = X509_get0_notBefore(certificate);
  const ASN1_TIME* const until = X509_get0_notAfter(certificate);
  if (X509_cmp_current_time(until) < 0)
    warnings->push_back(fmt::format("{}: the certificate has expired on {}; clients will refuse it",
                                    file, day_of(until)));
  if (X509_cmp_current_time(from) > 0)
    warnings->push_back(
        fmt::format("{}: the certificate is valid from {} on only; clients will refuse it", file,
                    day_of(from)));
}

bool fill_context(HttpTls::Context* context, const HttpTlsOptions& options, std::string* error,
                  std::vector<std::string>* warnings) {
  std::string certificate_text;
  std::string key_text;
  if (!read_file(options.certificate, &certificate_text, error) ||
      !read_file(options.key, &key_text, error))
    return false;
  const auto fail = [error](const std::string& file, const std::string& what) {
    *error = file + ": " + what;
    return false;
  };
  const Bio certificates = memory_of(certificate_text);
  const Certificate first(
      PEM_read_bio_X509(certificates.get(), nullptr, &has_no_password, nullptr));
  if (!first)
    return fail(options.certificate,
                "holds no certificate; expected one as PEM, `-----BEGIN CERTIFICATE-----`");
  bool asked = false;
  const Key key(
      PEM_read_bio_PrivateKey(memory_of(key_text).get(), nullptr, &has_no_password, &asked));
  if (!key)
    return fail(options.key,
                asked ? "the key is encrypted; expected one without a password, as `openssl pkey "
                        "-in " +
                            options.key + " -out NEW` makes"
                      : "holds no private key; expected one as PEM, `-----BEGIN PRIVATE KEY-----`");
  if (X509_check_private_key(first.get(), key.get()) != 1)
    return fail(options.key, "the key does not belong to the certificate in " +
                                 options.certificate + "; expected the one it was made for");
  SSL_CTX* const tls = context->native_handle();
  using Ssl = boost::asio::ssl::context;
  context->set_options(Ssl::default_workarounds | Ssl::no_sslv2 | Ssl::no_sslv3 | Ssl::no_tlsv1 |
                       Ssl::no_tlsv1_1 | Ssl::no_compression);
  SSL_CTX_set_options(tls, SSL_OP_NO_RENEGOTIATION);
  SSL_CTX_set_mode(tls, SSL_MODE_RELEASE_BUFFERS);
  SSL_CTX_set_session_cache_mode(tls, SSL_SESS_CACHE_OFF);
  if (SSL_CTX_use_certificate(tls, first.get()) != 1)
    return fail(options.certificate, "cannot be used: " + library_says());
  if (SSL_CTX_use_PrivateKey(tls, key.get()) != 1)
    return fail(options.key, "cannot be used: " + library_says());
  while (X509* const next =
             PEM_read_bio_X509(certificates.get(), nullptr, &has_no_password, nullptr)) {
    // On success the context owns it.
    if (SSL_CTX_add0_chain_cert(tls, next) == 1) continue;
    X509_free(next);
    return fail(options.certificate, "cannot be used: " + library_says());
  }
  check_validity(first.get(), options.certificate, warnings);
  if (FileStamp(options.key).is_public())
    warnings->push_back(options.key +
                        ": other users of this machine can read the key; chmod o= it");
  return true;
}

}  // namespace

bool HttpTls::load(std::string* error, std::vector<std::string>* warnings) {
  const Stamps stamps{FileStamp(options_.certificate), FileStamp(options_.key)};
  auto context = std::make_shared<Context>(Context::tls_server);
  const bool good = fill_context(context.get(), options_, error, warnings);
  ERR_clear_error();  // else the errors would show up in connections
  if (!good) return false;
  context_ = std::move(context);
  loaded_ = seen_ = stamps;
  return true;
}

bool HttpTls::have_changed_since(const Stamps& then) const {
  return FileStamp(options_.certificate) != then.certificate || FileStamp(options_.key) != then.key;
}

std::shared_ptr<HttpTls::Context> HttpTls::context(double now_s) {
  if (now_s < looked_s_ + kLookAtFilesAgainS) return context_;
  looked_s_ = now_s;
  if (!have_changed_since(loaded_)) return context_;
  const bool is_new = have_changed_since(seen_);
  std::string error;
  std::vector<std::string> warnings;
  if (load(&error, &warnings)) {
    said_ = false;
    spdlog::info("HTTP: {}: certificate and key were read anew", options_.certificate);
    for (const std::string& warning : warnings) spdlog::warn("HTTP: {}", warning);
    return context_;
  }
  // Report a failure only if the same files fail again: the second file may not be replaced yet.
  if (is_new) {
    said_ = false;
    seen_ = {FileStamp(options_.certificate), FileStamp(options_.key)};
  } else if (!std::exchange(said_, true)) {
    spdlog::warn("HTTP: {}; the earlier certificate stays in use", error);
  }
  return context_;
}

}  // namespace alidade
