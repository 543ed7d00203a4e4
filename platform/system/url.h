#pragma once
// Splits a URL (with libcurl) so that the password can be kept apart from what is shown and logged.
// `bare` is for connecting: its query may hold a password, as cameras take one there, too. Only
// `shown`, or shown_url() of a foreign URL, may be shown or logged.

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
  std::string bare;      // the URL without user and password; its query may hold some
  std::string shown;     // bare, without_secrets(); of a text that is no URL: what may be shown
};

// On false, text is not a URL, *error says so, url->bare is url->shown, and the rest is unchanged.
[[nodiscard]] bool parse_url(const std::string& text, Url* url, std::string* error);

// "***" in place of each value whose key sounds like a secret (password, pwd, token, user ...):
// srt://h:1?passphrase=***. A value ends at the next of & ; #, before the query also at / and ?.
[[nodiscard]] std::string without_secrets(std::string_view url);

// A foreign address for messages, without secrets: its first 120 bytes, escaped. text may be no
// URL.
[[nodiscard]] std::string shown_url(const std::string& text);

// True if the text is a URL over TLS, or the scheme of one: https, rtsps, mqtts.
[[nodiscard]] bool is_by_tls(std::string_view url_or_scheme);

// Resolves `told`, which may be relative, against the URL `base`. Empty if the result is not a URL.
[[nodiscard]] std::string resolved_url(const std::string& base, const std::string& told);

}  // namespace alidade
