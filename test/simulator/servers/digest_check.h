#pragma once
// DigestCheck: the server's side of HTTP digest authentication with qop=auth (RFC 7616), and of basic
// (RFC 7617): written from the RFCs, with OpenSSL's hashes. Like many a camera it knows one nonce, and does not
// say of another one that it is stale.

#include <atomic>
#include <string>

namespace alidade {

class DigestCheck {
 public:
  enum class Algorithm { kMd5, kSha256 };

  // user empty: everybody is let in.
  DigestCheck(std::string user, std::string password, Algorithm algorithm = Algorithm::kMd5);

  // Thread-safe: as a camera that restarts; the nonce so far is refused.
  void renew_nonce();

  // The value of WWW-Authenticate.
  std::string challenge() const;

  // authorization: the value of the request's header, empty if it has none.
  bool accepts(const std::string& method, const std::string& target,
               const std::string& authorization) const;

 private:
  std::string hash(const std::string& text) const;
  std::string nonce() const { return "0123456789abcdef" + std::to_string(nonce_); }

  std::string user_;
  std::string password_;
  Algorithm algorithm_;
  std::atomic<int> nonce_;  // none is used twice in a process
};

// Whether the header is that of basic authentication with this user and password.
bool accepts_basic(const std::string& user, const std::string& password,
                   const std::string& authorization);

// The value of a header in a request's text, empty if it has none.
std::string header_of(const std::string& request, const std::string& name);

// Hashes as raw bytes, and base 64.
std::string sha1(const std::string& bytes);
std::string base64(const std::string& bytes);
std::string from_base64(const std::string& text);

}  // namespace alidade
