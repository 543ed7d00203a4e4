#include "platform/system/link_rules.h"

#include <algorithm>
#include <cctype>

#include "platform/system/shown.h"

namespace alidade {
namespace {

std::string without_tls(const std::string& scheme) {
  return is_by_tls(scheme) ? scheme.substr(0, scheme.size() - 1) : scheme;
}

std::string in_small_letters(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  });
  return text;
}

std::string port_of(const Url& url) {
  if (!url.port.empty()) return url.port;
  if (url.scheme == "https") return "443";
  if (url.scheme == "http") return "80";
  return url.scheme == "rtsps" ? "322" : "554";
}

// How an address differs from the configured one; empty if it does not.
std::string difference(const Url& configured, const Url& told) {
  if (in_small_letters(told.host) != in_small_letters(configured.host)) return "another host";
  if (told.scheme != configured.scheme) return "another scheme";
  if (port_of(told) != port_of(configured)) return "another port";
  return "";
}

std::string origin_of(const Url& url) {
  return url.scheme + "://" + url.host + (url.port.empty() ? "" : ":" + url.port);
}

}  // namespace

// The URL to ask is assembled from the parts that were judged: another parser might find another
// host in the peer's text.
Redirection judge_redirection(const Url& configured, const std::string& asked,
                              const std::string& told, LinkRules::Redirects rule) {
  Redirection result;
  Url url;
  std::string ignored;
  const bool is_url = parse_url(resolved_url(asked, told), &url, &ignored);
  const std::string what = "redirected to " + shown_url(is_url ? url.bare : told);
  if (!is_url || url.host.empty() || without_tls(url.scheme) != without_tls(configured.scheme)) {
    result.error = what + ", which is no address of this kind: refused";
    return result;
  }
  const std::string other = difference(configured, url);
  if (is_by_tls(configured.scheme) && !is_by_tls(url.scheme)) {
    result.error = what + ", away from TLS: refused";
  } else if (other.empty()) {
    result.takes_login = true;
    result.url = origin_of(configured) + url.path;
  } else if (rule == LinkRules::Redirects::kAny) {
    result.url = origin_of(url) + url.path;
  } else {
    result.error = what + ", " + other +
                   ": refused; if that is the camera, set url to it, or follow_redirects: any, "
                   "which leaves out user and password";
  }
  return result;
}

std::string login_wanted_elsewhere(const std::string& url) {
  return "redirected to " + shown_url(url) +
         ", which wants a login (401), but the login is sent to url only; set url to that address";
}

}  // namespace alidade
