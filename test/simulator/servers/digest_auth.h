#pragma once
// The server's side of HTTP digest authentication (RFC 7616 with MD5 and qop=auth, as Axis does):
//   HA1 = MD5(user:realm:password), HA2 = MD5(method:uri),
//   response = MD5(HA1:nonce:nc:cnonce:qop:HA2)
// A nonce is random, made by this object, and lives until kMaxNonces newer ones were made. Its
// count nc must grow with every request (a repeated one is a replay). A nonce this object does not
// know is answered with stale=true, so that a client tries again with the password it has.
// Allocates. Thread-safe. No clock and no socket.

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

namespace alidade {

// The request-digest of RFC 7616, section 3.4.1, in lower-case hexadecimal.
[[nodiscard]] std::string digest_response(const std::string& user, const std::string& realm,
                                          const std::string& password, const std::string& method,
                                          const std::string& uri, const std::string& nonce,
                                          const std::string& nc, const std::string& cnonce);

enum class DigestStatus {
  kOk,
  kMissing,   // no digest credentials at all
  kStale,     // a nonce of another life of this server, or a replayed count
  kRejected,  // malformed, another URI, wrong user or wrong password
};

class DigestAuth {
 public:
  static constexpr std::size_t kMaxNonces = 64;

  DigestAuth(std::string user, std::string password, std::string realm);

  // authorization: the value of the header "Authorization", empty if there was none.
  // target: the request target as it stood in the request line.
  [[nodiscard]] DigestStatus check(const std::string& method, const std::string& target,
                                   const std::string& authorization);

  // The value of the header "WWW-Authenticate" that answers anything but kOk.
  [[nodiscard]] std::string challenge(DigestStatus status);

 private:
  const std::string user_;
  const std::string password_;
  const std::string realm_;
  std::mutex mutex_;
  struct Nonce {
    std::uint64_t age_key = 0;     // grows with each nonce made
    std::uint64_t last_count = 0;  // highest nc accepted
  };
  std::map<std::string, Nonce> nonces_;
  std::uint64_t nonces_made_ = 0;
};

}  // namespace alidade
