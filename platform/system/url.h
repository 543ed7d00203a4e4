#pragma once
// Splits a URL (with libcurl) so that the password can be kept apart from what is shown and logged.

#include <string>
#include <string_view>

namespace alidade {

struct Url {
  std::string scheme;
  std::string host;      // may be empty: file:///a
  std::string port;      // empty if not given
  std::string path;      // with its leading '/', and the query
  std::string user;      // decoded
  std::string password;  // decoded
  std::string bare;      // the URL without user and password
};

// On false, text is not a URL, *error says so, and url->bare is the part that may be shown.
[[nodiscard]] bool parse_url(const std::string& text, Url* url, std::string* error);

// True if the URL's scheme, or the scheme alone, is one over TLS: https, rtsps, mqtts.
[[nodiscard]] bool is_by_tls(std::string_view url_or_scheme);

// Resolves `told`, which may be relative, against the URL `base`. Empty if the result is not a URL.
[[nodiscard]] std::string resolved_url(const std::string& base, const std::string& told);

}  // namespace alidade
