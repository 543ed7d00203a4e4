#pragma once
// Owners of libcurl's handles, and the settings that all HTTP links share.

#include <curl/curl.h>

#include <cstddef>
#include <memory>
#include <string>

#include "platform/system/link_rules.h"

namespace alidade {

struct CurlEasyCleanup {
  void operator()(CURL* easy) const { curl_easy_cleanup(easy); }
};
struct CurlMultiCleanup {
  void operator()(CURLM* multi) const { curl_multi_cleanup(multi); }
};
using CurlEasyPtr = std::unique_ptr<CURL, CurlEasyCleanup>;
using CurlMultiPtr = std::unique_ptr<CURLM, CurlMultiCleanup>;

// Limit on the headers of one answer. libcurl itself would keep any amount.
constexpr std::size_t kMostHeaderBytes = 64U << 10U;
constexpr const char* kHeadersTooLong = "the answer's headers are longer than 64 KB";

// Returns a handle for http and https, without proxy and signals, or null if libcurl does not
// start. methods: CURLAUTH_..., used if user is not empty. error_buffer has CURL_ERROR_SIZE bytes
// and must outlive the handle.
[[nodiscard]] CurlEasyPtr make_http_handle(const std::string& user, const std::string& password,
                                           long methods, char* error_buffer);
[[nodiscard]] CurlMultiPtr make_curl_multi();

// The CURLAUTH_... methods that a 401 answer offers.
[[nodiscard]] long offered_methods(CURL* easy);

// The message to the user on why the answer was 401; methods as in make_http_handle().
[[nodiscard]] std::string login_error(CURL* easy, const std::string& user, long methods);

// Where the complete answer from the URL `asked` redirects to. If the answer is not a redirection,
// url and error of the result are empty.
[[nodiscard]] Redirection redirection_of(CURL* easy, const Url& configured,
                                         const std::string& asked, LinkRules::Redirects rule);

}  // namespace alidade
