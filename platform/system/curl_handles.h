#pragma once
// Owners of libcurl's handles, and what every HTTP link of ours has in common.

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

// Of an answer's headers, whichever HTTP link: libcurl keeps all of them, without end.
constexpr std::size_t kMostHeaderBytes = 64U << 10U;
constexpr const char* kHeadersTooLong = "the answer's headers are longer than 64 KB";

// A handle without proxy and signals; null if libcurl does not start. methods: CURLAUTH_..., used
// if user is not empty. error_buffer of CURL_ERROR_SIZE bytes must outlive the handle.
[[nodiscard]] CurlEasyPtr make_http_handle(const std::string& user, const std::string& password,
                                           long methods, char* error_buffer);
[[nodiscard]] CurlMultiPtr make_curl_multi();

// The CURLAUTH_... that an answer of 401 offers.
[[nodiscard]] long offered_methods(CURL* easy);

// Why the answer was 401, for the person; methods as given above.
[[nodiscard]] std::string login_error(CURL* easy, const std::string& user, long methods);

// Where a whole answer of the URL `asked` sends the client on; url and error empty: nowhere.
[[nodiscard]] Redirection redirection_of(CURL* easy, const Url& configured,
                                         const std::string& asked, LinkRules::Redirects rule);

}  // namespace alidade
