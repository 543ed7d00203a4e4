#pragma once
// LinkRules: what the peer of a link may decide: where else to ask, and how to log in. Whoever stands between can say
// what the peer says, so user and password go to the host, port and scheme that the user named only, and over a
// connection without TLS only by digest, unless the user says otherwise. Pure.

#include <optional>
#include <string>

#include "platform/system/url.h"

namespace alidade {

struct LinkRules {
  // kAny: to other hosts and ports, too, without user and password, and never from TLS to none.
  enum class Redirects { kSameHost, kAny };
  // kDigest: never the password itself.
  enum class Auth { kDigest, kAny };

  Redirects redirects = Redirects::kSameHost;
  std::optional<Auth> auth;  // none: kDigest without TLS, kAny with it

  [[nodiscard]] bool permits_basic(bool by_tls) const {
    return auth ? *auth == Auth::kAny : by_tls;
  }
};

// Of one link: most redirections in a row.
constexpr int kMostRedirections = 5;

// "the camera offers only ...", of one that wants what permits_basic() refuses.
inline constexpr const char* kOnlyBasic =
    "the camera offers no digest authentication, and by basic the password would cross the network "
    "in clear: set the camera to digest, use TLS, or, on a network that nobody else reads, set "
    "auth: any";

struct Redirection {
  std::string url;           // to ask, without user and password; empty: refused
  bool takes_login = false;  // it is the configured host, port and scheme
  std::string error;         // refused: why, with the address that was told
};

// configured: what the user named, with a scheme of http, https, rtsp or rtsps. asked: what has just answered so. told: its
// Location, which may be relative.
[[nodiscard]] Redirection judge_redirection(const Url& configured, const std::string& asked,
                                            const std::string& told, LinkRules::Redirects rule);

// Why a link ends whose redirection led to `url`, where a login is wanted that does not go there.
[[nodiscard]] std::string login_wanted_elsewhere(const std::string& url);

}  // namespace alidade
