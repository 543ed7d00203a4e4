#include "platform/system/url.h"

#include <curl/curl.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <memory>

#include "platform/system/shown.h"

namespace alidade {
namespace {

using Handle = std::unique_ptr<CURLU, decltype(&curl_url_cleanup)>;

constexpr unsigned kAnyScheme = CURLU_NON_SUPPORT_SCHEME | CURLU_NO_AUTHORITY;

Handle parsed(const std::string& text) {
  Handle handle(curl_url(), curl_url_cleanup);
  if (handle && curl_url_set(handle.get(), CURLUPART_URL, text.c_str(), kAnyScheme) != CURLUE_OK) {
    handle.reset();
  }
  return handle;
}

std::string part(const Handle& handle, CURLUPart which, unsigned flags = 0) {
  char* text = nullptr;
  if (curl_url_get(handle.get(), which, &text, flags) != CURLUE_OK) {
    return {};
  }
  const std::unique_ptr<char, decltype(&curl_free)> owner(text, curl_free);
  return text;
}

// Keys of cameras: password, passphrase, loginpas, pwd, usr, user, access_token, api-key, auth ...
// One in %XX may spell anything.
bool is_secret(std::string_view key) {
  constexpr std::array<std::string_view, 11> kWords = {
      "pas", "pwd", "user", "usr", "login", "key", "auth", "secret", "token", "cred", "signature"};
  std::string small(key);
  std::transform(small.begin(), small.end(), small.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return small == "pw" || small.find('%') != std::string::npos ||
         std::any_of(kWords.begin(), kWords.end(), [&small](std::string_view word) {
           return small.find(word) != std::string::npos;
         });
}

// A piece between two separators: key=value, or user=a_password=b, as some cameras have it.
std::string piece_without_secrets(std::string_view piece) {
  std::size_t key = 0;
  for (std::size_t at = piece.find('='); at != std::string_view::npos; at = piece.find('=', key)) {
    if (is_secret(piece.substr(key, at - key))) return std::string(piece.substr(0, at + 1)) + "***";
    key = at + 1;
  }
  return std::string(piece);
}

}  // namespace

bool parse_url(const std::string& text, Url* url, std::string* error) {
  const Handle handle = parsed(text);
  // With an @ in the zone, the URL as shown would seem to have a user before it.
  if (!handle || part(handle, CURLUPART_ZONEID).find('@') != std::string::npos) {
    const std::size_t scheme_end = text.find("://");
    const std::size_t at = text.rfind('@');  // the text before it may be a password
    const std::string rest = at == std::string::npos ? text : "..." + text.substr(at);
    url->bare = url->shown = without_secrets(
        shown(scheme_end == std::string::npos ? rest : text.substr(0, scheme_end) + "://..."));
    *error =
        "not a URL; it must look like scheme://host[:port]/path, special characters of a user or "
        "password written as %XX";
    return false;
  }
  url->scheme = part(handle, CURLUPART_SCHEME);
  url->host = part(handle, CURLUPART_HOST);
  url->port = part(handle, CURLUPART_PORT);
  url->path = part(handle, CURLUPART_PATH);
  const std::string query = part(handle, CURLUPART_QUERY);
  if (!query.empty()) {
    url->path += "?" + query;
  }
  url->user = part(handle, CURLUPART_USER, CURLU_URLDECODE);
  url->password = part(handle, CURLUPART_PASSWORD, CURLU_URLDECODE);
  curl_url_set(handle.get(), CURLUPART_USER, nullptr, 0);
  curl_url_set(handle.get(), CURLUPART_PASSWORD, nullptr, 0);
  url->bare = part(handle, CURLUPART_URL, kAnyScheme);
  url->shown = without_secrets(url->bare);
  return true;
}

std::string without_secrets(std::string_view url) {
  std::string result;
  bool in_query = false;  // there / and ? are parts of a value
  while (true) {
    const std::size_t end = url.find_first_of(in_query ? "&;#" : "?&;/#");
    result += piece_without_secrets(url.substr(0, end));
    if (end == std::string_view::npos) return result;
    result += url[end];
    in_query = url[end] != '#' && (in_query || url[end] == '?');
    url.remove_prefix(end + 1);
  }
}

std::string shown_url(const std::string& text) {
  constexpr std::size_t kMost = 120;  // bytes
  Url url;
  std::string error;
  const bool is_plain = parse_url(text, &url, &error) && url.user.empty() && url.password.empty();
  return shown(is_plain ? without_secrets(text) : url.shown, kMost);
}

bool is_by_tls(std::string_view url_or_scheme) {
  const std::string_view scheme = url_or_scheme.substr(0, url_or_scheme.find("://"));
  return scheme == "https" || scheme == "rtsps" || scheme == "mqtts";
}

std::string resolved_url(const std::string& base, const std::string& told) {
  const Handle handle = parsed(base);
  if (!handle || curl_url_set(handle.get(), CURLUPART_URL, told.c_str(), kAnyScheme) != CURLUE_OK) {
    return {};
  }
  return part(handle, CURLUPART_URL, kAnyScheme);
}

}  // namespace alidade
