#include "platform/system/curl_handles.h"

#include <mutex>

namespace alidade {
namespace {

void initialise_curl() {
  static std::once_flag initialised;
  std::call_once(initialised, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
}

}  // namespace

CurlEasyPtr make_http_handle(const std::string& user, const std::string& password, long methods,
                             char* error_buffer) {
  initialise_curl();
  CurlEasyPtr easy(curl_easy_init());
  if (!easy) {
    return easy;
  }
  if (!user.empty()) {
    curl_easy_setopt(easy.get(), CURLOPT_HTTPAUTH, methods);
    curl_easy_setopt(easy.get(), CURLOPT_USERNAME, user.c_str());
    curl_easy_setopt(easy.get(), CURLOPT_PASSWORD, password.c_str());
  }
  curl_easy_setopt(easy.get(), CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(easy.get(), CURLOPT_NOPROXY, "*");
  curl_easy_setopt(easy.get(), CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(easy.get(), CURLOPT_ERRORBUFFER, error_buffer);
  // A thread that ends need not wait for a name look-up.
  curl_easy_setopt(easy.get(), CURLOPT_QUICK_EXIT, 1L);
  return easy;
}

CurlMultiPtr make_curl_multi() {
  initialise_curl();
  return CurlMultiPtr(curl_multi_init());
}

long offered_methods(CURL* easy) {
  long offered = 0;
  curl_easy_getinfo(easy, CURLINFO_HTTPAUTH_AVAIL, &offered);
  return offered;
}

std::string login_error(CURL* easy, const std::string& user, long methods) {
  if (user.empty()) {
    return "the camera wants a user and a password (401)";
  }
  const long offered = offered_methods(easy);
  if ((offered & methods) != 0) {
    return "wrong user or password (401)";
  }
  if ((offered & static_cast<long>(CURLAUTH_BASIC)) != 0) {
    return std::string(kOnlyBasic) + " (401)";
  }
  return std::string("the camera does not offer HTTP digest ") +
         ((methods & static_cast<long>(CURLAUTH_BASIC)) != 0 ? "or basic " : "") +
         "authentication (401)";
}

Redirection redirection_of(CURL* easy, const Url& configured, const std::string& asked,
                           LinkRules::Redirects rule) {
  long status = 0;
  curl_easy_getinfo(easy, CURLINFO_RESPONSE_CODE, &status);
  curl_header* location = nullptr;
  if (status / 100 != 3 ||
      curl_easy_header(easy, "Location", 0, CURLH_HEADER, -1, &location) != CURLHE_OK) {
    return {};
  }
  return judge_redirection(configured, asked, location->value, rule);
}

}  // namespace alidade
