#include "platform/discovery/http_question.h"

#include <cmath>
#include <memory>

#include "platform/system/curl_handles.h"
#include "platform/system/url.h"

namespace alidade {
namespace {

struct ListCleanup {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};
using List = std::unique_ptr<curl_slist, ListCleanup>;

struct Receiver {
  std::string* body;
  std::size_t most;
  std::size_t header_bytes = 0;
};

std::size_t take_body(char* data, std::size_t size, std::size_t count, void* self) {
  auto* receiver = static_cast<Receiver*>(self);
  const std::size_t bytes = size * count;
  if (receiver->body->size() + bytes > receiver->most) return 0;
  receiver->body->append(data, bytes);
  return bytes;
}

// A new status line begins the answer behind a 401.
std::size_t take_header(char* data, std::size_t size, std::size_t count, void* self) {
  auto* receiver = static_cast<Receiver*>(self);
  const std::size_t bytes = size * count;
  if (std::string_view(data, bytes).substr(0, 5) == "HTTP/") receiver->body->clear();
  receiver->header_bytes += bytes;
  return receiver->header_bytes <= kMostHeaderBytes ? bytes : 0;
}

}  // namespace

HttpReply ask_http(const HttpQuestion& question) {
  HttpReply reply;
  char error[CURL_ERROR_SIZE] = "";
  const bool basic = question.rules.permits_basic(is_by_tls(question.url));
  const long methods =
      static_cast<long>(CURLAUTH_DIGEST) | (basic ? static_cast<long>(CURLAUTH_BASIC) : 0L);
  const CurlEasyPtr easy = make_http_handle(question.user, question.password, methods, error);
  if (!easy) {
    reply.error = "libcurl does not start";
    return reply;
  }
  List headers;
  for (const std::string& header : question.headers) {
    if (curl_slist* longer = curl_slist_append(headers.get(), header.c_str())) {
      (void)headers.release();
      headers.reset(longer);
    }
  }
  Receiver receiver{&reply.body, question.most_bytes, 0};
  curl_easy_setopt(easy.get(), CURLOPT_URL, question.url.c_str());
  curl_easy_setopt(easy.get(), CURLOPT_HTTPHEADER, headers.get());
  curl_easy_setopt(easy.get(), CURLOPT_TIMEOUT_MS, std::lround(1e3 * question.timeout_s));
  curl_easy_setopt(easy.get(), CURLOPT_WRITEFUNCTION, &take_body);
  curl_easy_setopt(easy.get(), CURLOPT_WRITEDATA, &receiver);
  curl_easy_setopt(easy.get(), CURLOPT_HEADERFUNCTION, &take_header);
  curl_easy_setopt(easy.get(), CURLOPT_HEADERDATA, &receiver);
  if (question.body) {
    curl_easy_setopt(easy.get(), CURLOPT_POSTFIELDS, question.body->c_str());
    curl_easy_setopt(easy.get(), CURLOPT_POSTFIELDSIZE, static_cast<long>(question.body->size()));
  }
  const CURLcode code = curl_easy_perform(easy.get());
  if (code == CURLE_OPERATION_TIMEDOUT) {
    reply.error = "no answer in time";
  } else if (code == CURLE_WRITE_ERROR) {
    reply.error = "an answer that is longer than it can be";
  } else if (code != CURLE_OK) {
    reply.error = error[0] == '\0' ? curl_easy_strerror(code) : error;
  }
  if (code != CURLE_OK) {
    reply.body.clear();
    return reply;
  }
  curl_easy_getinfo(easy.get(), CURLINFO_RESPONSE_CODE, &reply.status);
  if (reply.status == 401) {
    reply.offers_digest = (offered_methods(easy.get()) & methods) != 0;
    reply.error = login_error(easy.get(), question.user, methods);
  }
  return reply;
}

}  // namespace alidade
