#pragma once
// LinkRules: what the peer of a link may decide: redirections and the login method. An attacker on
// the network can forge the peer's messages. Therefore user and password go only to the host, port
// and scheme that the user configured, and without TLS only by digest, unless the user permits
// more. No side effects.

#include <optional>
#include <string>

#include "platform/system/url.h"

namespace alidade {

struct LinkRules {
  // kSameHost: only to the configured host, port and scheme. kAny: also elsewhere, but without user
  // and password, and never from TLS to plain.
  enum class Redirects { kSameHost, kAny };
  // kDigest: never the password itself. kAny: also basic, if the peer offers nothing else.
  enum class Auth { kDigest, kAny };

  Redirects redirects = Redirects::kSameHost;
  std::optional<Auth> auth;  // nullopt: kDigest without TLS, kAny with TLS

  [[nodiscard]] bool permits_basic(bool by_tls) const {
    return auth ? *auth == Auth::kAny : by_tls;
  }
};

// Most redirections in a row on one link.
constexpr int kMostRedirections = 5;

// "the camera offers only ...": the message for a camera that demands a basic login where
// permits_basic() is false.
inline constexpr const char* kOnlyBasic =
    "the camera offers no digest authentication, and by basic the password would cross the network "
    "in clear: set the camera to digest, use TLS, or, on a network that nobody else reads, set "
    "auth: any";

struct Redirection {
  std::string url;           // the URL to ask next, without user and password; empty: refused
  bool takes_login = false;  // the URL has the configured host, port and scheme
  std::string error;         // if refused: why, with the address that the peer gave
};

// configured: the user's URL, scheme http, https, rtsp or rtsps. asked: the URL that answered with
// the redirection. told: its Location header, may be relative.
[[nodiscard]] Redirection judge_redirection(const Url& configured, const std::string& asked,
                                            const std::string& told, LinkRules::Redirects rule);

// The error of a link that ends because it was redirected to `url`, which demands a login. The
// login is never sent there.
[[nodiscard]] std::string login_wanted_elsewhere(const std::string& url);

}  // namespace alidade
