#pragma once
// Splits a URL (with libcurl) so that the password can be kept apart from what is shown and logged.

#include <string>

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

// False: text is no URL; *error says so, and url->bare is what of it can be shown.
[[nodiscard]] bool parse_url(const std::string& text, Url* url, std::string* error);

// `told`, which may be relative to the URL `base`, as a whole one; empty: neither.
[[nodiscard]] std::string resolved_url(const std::string& base, const std::string& told);

}  // namespace alidade
