#include "platform/pan_tilt/http_polling_source.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <string_view>
#include <utility>

#include "platform/pan_tilt/source_notes.h"
#include "platform/system/backoff.h"
#include "platform/system/clock.h"
#include "platform/system/curl_handles.h"
#include "platform/system/shown.h"

namespace alidade {
namespace {

constexpr const char* kNoCurl = "libcurl does not start";
constexpr long kDigest = static_cast<long>(CURLAUTH_DIGEST);
constexpr long kBasic = static_cast<long>(CURLAUTH_BASIC);

struct HeaderListCleanup {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};
using HeaderListPtr = std::unique_ptr<curl_slist, HeaderListCleanup>;

HeaderListPtr header_list(const std::vector<std::string>& headers) {
  HeaderListPtr list;
  for (const std::string& header : headers) {
    if (curl_slist* longer = curl_slist_append(list.get(), header.c_str())) {
      (void)list.release();
      list.reset(longer);
    }
  }
  return list;
}

class HttpPollingSource : public PanTiltSource {
 public:
  explicit HttpPollingSource(HttpPollingPlan plan);
  ~HttpPollingSource() override {
    if (under_way_) {
      curl_multi_remove_handle(multi_.get(), easy_.get());
    }
  }

  ReadStatus read(PanTiltSample& sample, double timeout_s) override;

  void stop() override {
    stopped_ = true;
    if (multi_) {
      curl_multi_wakeup(multi_.get());
    }
  }

  std::string error() const override { return error_; }
  std::string name() const override { return options_.name; }
  std::vector<std::string> take_notes() override { return notes_.take(); }

 private:
  static std::size_t on_header(char* data, std::size_t size, std::size_t count, void* self);
  static std::size_t on_body(char* data, std::size_t size, std::size_t count, void* self);
  bool make_handle();
  void start_request(double now_s);
  void send_request(const std::string& url, bool elsewhere);
  // kOk: the answer is not a redirection. kTimeout: the request was sent to another URL.
  ReadStatus follow_redirection();
  bool request_is_over(CURLcode* code);
  [[nodiscard]] long status() const {
    long status = 0;
    curl_easy_getinfo(easy_.get(), CURLINFO_RESPONSE_CODE, &status);
    return status;
  }
  HttpAnswer answer() const;
  // kTimeout: no sample, but no failure either.
  ReadStatus finish_request(CURLcode code, PanTiltSample* sample);
  ReadStatus fail(const std::string& error);
  ReadStatus disconnect(const std::string& error) { return pause(error, backoff_.next_s()); }
  ReadStatus refuse(const std::string& error);
  ReadStatus pause(const std::string& error, double pause_s);

  HttpPollingOptions options_;
  std::unique_ptr<HttpConversation> conversation_;
  std::string error_;
  bool failed_ = false;
  std::atomic<bool> stopped_{false};

  char curl_error_[CURL_ERROR_SIZE] = "";
  CurlMultiPtr multi_;
  CurlEasyPtr easy_;        // one for all requests: keeps the connection and the digest nonce
  bool logged_in_ = false;  // the nonce was accepted
  long method_ = kDigest;   // basic only where it is permitted and the only method offered

  double period_s_;
  double due_s_ = 0;     // when to send the next poll
  bool ask_on_ = false;  // the next request is sent at once
  Backoff backoff_;
  bool restarted_ = true;
  bool worked_ = false;  // a sample has come, or could have
  int refusals_ = 0;     // refused logins since the latest sample
  SourceNotes notes_;

  // The outstanding request.
  bool under_way_ = false;
  HttpRequest request_;
  std::string asked_;  // its URL, after redirections_ redirections
  int redirections_ = 0;
  bool elsewhere_ = false;  // at another host, port or scheme: without login
  HeaderListPtr headers_;
  double started_s_ = 0;
  double previous_answer_s_ = 0;  // of an answer 401 to the same request, before the latest answer
  double answer_s_ = 0;           // arrival of the first bytes of the latest answer
  std::size_t header_bytes_ = 0;
  std::string body_;
};

HttpPollingSource::HttpPollingSource(HttpPollingPlan plan)
    : options_(std::move(plan.options)),
      conversation_(std::move(plan.conversation)),
      period_s_(1 / options_.rate_hz),
      backoff_(options_.max_backoff_s) {
  if (!plan.error.empty()) {
    (void)fail(plan.error);
    return;
  }
  if (!(options_.rate_hz > 0)) {
    (void)fail("rate_hz must be positive");
    return;
  }
  multi_ = make_curl_multi();
  if (!multi_ || !make_handle()) {
    (void)fail(kNoCurl);
  }
}

bool HttpPollingSource::make_handle() {
  easy_ = make_http_handle(options_.user, options_.password, method_, curl_error_);
  if (!easy_) {
    return false;
  }
  curl_easy_setopt(easy_.get(), CURLOPT_TIMEOUT_MS, std::lround(1e3 * options_.timeout_s));
  curl_easy_setopt(easy_.get(), CURLOPT_HEADERFUNCTION, &HttpPollingSource::on_header);
  curl_easy_setopt(easy_.get(), CURLOPT_HEADERDATA, this);
  curl_easy_setopt(easy_.get(), CURLOPT_WRITEFUNCTION, &HttpPollingSource::on_body);
  curl_easy_setopt(easy_.get(), CURLOPT_WRITEDATA, this);
  return true;
}

std::size_t HttpPollingSource::on_header(char* data, std::size_t size, std::size_t count,
                                         void* self) {
  auto* poll = static_cast<HttpPollingSource*>(self);
  const std::size_t bytes = size * count;
  if (std::string_view(data, bytes).substr(0, 5) == "HTTP/") {
    poll->previous_answer_s_ = poll->answer_s_;
    poll->answer_s_ = monotonic_now_s();
    poll->body_.clear();
  }
  poll->header_bytes_ += bytes;
  return poll->header_bytes_ <= kMostHeaderBytes ? bytes : 0;
}

std::size_t HttpPollingSource::on_body(char* data, std::size_t size, std::size_t count,
                                       void* self) {
  auto* poll = static_cast<HttpPollingSource*>(self);
  const std::size_t bytes = size * count;
  if (poll->body_.size() + bytes > poll->options_.max_body) {
    return 0;  // ends the transfer with CURLE_WRITE_ERROR
  }
  poll->body_.append(data, bytes);
  return bytes;
}

ReadStatus HttpPollingSource::fail(const std::string& error) {
  error_ = options_.name + ": " + error;
  failed_ = true;
  return ReadStatus::kFailed;
}

ReadStatus HttpPollingSource::pause(const std::string& error, double pause_s) {
  error_ = options_.name + ": " + error;
  restarted_ = true;
  ask_on_ = false;
  due_s_ = monotonic_now_s() + pause_s;
  return ReadStatus::kDisconnected;
}

// A device that has worked refuses the login. The nonces are dropped with the handle: they may be
// too old at the next attempt, and libcurl would take that for a wrong password.
ReadStatus HttpPollingSource::refuse(const std::string& error) {
  method_ = kDigest;
  if (!make_handle()) {
    return fail(kNoCurl);
  }
  const double pause_s =
      refusals_ == 0 ? backoff_.next_s()
                     : options_.max_backoff_s *
                           std::min(kMostRefusalPauses, std::exp2(std::min(refusals_ - 1, 10)));
  ++refusals_;
  return pause(error + "; it was right before", pause_s);
}

void HttpPollingSource::start_request(double now_s) {
  if (!std::exchange(ask_on_, false)) {
    // The next grid point in the future.
    due_s_ = due_s_ == 0
                 ? now_s + period_s_
                 : due_s_ + period_s_ * std::max(1.0, std::ceil((now_s - due_s_) / period_s_));
  }
  request_ = conversation_->next_request(now_s);
  redirections_ = 0;
  send_request(request_.url, false);
}

void HttpPollingSource::send_request(const std::string& url, bool elsewhere) {
  asked_ = url;
  elsewhere_ = elsewhere;
  headers_ = header_list(request_.headers);
  curl_easy_setopt(easy_.get(), CURLOPT_URL, asked_.c_str());
  curl_easy_setopt(easy_.get(), CURLOPT_HTTPHEADER, headers_.get());
  if (!options_.user.empty()) {
    curl_easy_setopt(easy_.get(), CURLOPT_HTTPAUTH,
                     request_.digest && !elsewhere ? method_ : static_cast<long>(CURLAUTH_NONE));
  }
  if (request_.body) {
    curl_easy_setopt(easy_.get(), CURLOPT_POSTFIELDS, request_.body->c_str());
    curl_easy_setopt(easy_.get(), CURLOPT_POSTFIELDSIZE, static_cast<long>(request_.body->size()));
  } else {
    curl_easy_setopt(easy_.get(), CURLOPT_HTTPGET, 1L);
  }
  body_.clear();
  header_bytes_ = 0;
  curl_error_[0] = '\0';
  answer_s_ = 0;
  previous_answer_s_ = 0;
  under_way_ = true;
  started_s_ = monotonic_now_s();
  curl_multi_add_handle(multi_.get(), easy_.get());
}

bool HttpPollingSource::request_is_over(CURLcode* code) {
  int running = 0;
  curl_multi_perform(multi_.get(), &running);
  int queued = 0;
  const CURLMsg* message = curl_multi_info_read(multi_.get(), &queued);
  if (message == nullptr || message->msg != CURLMSG_DONE) {
    return false;
  }
  *code = message->data.result;
  curl_multi_remove_handle(multi_.get(), easy_.get());
  under_way_ = false;
  return true;
}

HttpAnswer HttpPollingSource::answer() const {
  HttpAnswer answer;
  answer.status = status();
  if (answer.status == 401) {
    const long offered = offered_methods(easy_.get());
    const bool basic = options_.rules.permits_basic(is_by_tls(asked_));
    answer.offers_digest = (offered & (basic ? kDigest | kBasic : kDigest)) != 0;
    answer.only_basic = !basic && (offered & (kDigest | kBasic)) == kBasic;
    answer.login_error = login_error(easy_.get(), options_.user, method_);
  }
  answer.body = body_;
  // The request was sent after the connection was established (libcurl counts from a moment after
  // started_s_) and after a possible 401. CURLINFO_PRETRANSFER_TIME_T is too late: it is taken when
  // the request has been sent.
  curl_off_t connected_us = 0;
  curl_off_t encrypted_us = 0;
  curl_easy_getinfo(easy_.get(), CURLINFO_CONNECT_TIME_T, &connected_us);
  curl_easy_getinfo(easy_.get(), CURLINFO_APPCONNECT_TIME_T, &encrypted_us);
  const double ready_s =
      started_s_ + 1e-6 * static_cast<double>(std::max(connected_us, encrypted_us));
  answer.latest_time_s = answer_s_;
  answer.earliest_time_s = std::min(std::max(ready_s, previous_answer_s_), answer_s_);
  return answer;
}

ReadStatus HttpPollingSource::follow_redirection() {
  const Redirection next =
      redirection_of(easy_.get(), options_.configured, asked_, options_.rules.redirects);
  std::string error = next.error;
  if (next.url.empty() && error.empty()) return ReadStatus::kOk;
  if (error.empty() && ++redirections_ > kMostRedirections) {
    error = "more than " + std::to_string(kMostRedirections) + " redirections";
  } else if (error.empty() && !next.takes_login && request_.body_logs_in) {
    error = "redirected to " + shown_url(next.url) +
            ": refused, as the request holds the login, which is sent to url only; set url to that "
            "address";
  }
  if (!error.empty()) {
    conversation_->reset();
    return disconnect(error);
  }
  send_request(next.url, !next.takes_login);
  return ReadStatus::kTimeout;
}

ReadStatus HttpPollingSource::finish_request(CURLcode code, PanTiltSample* sample) {
  if (code != CURLE_OK) {
    if (conversation_->unanswered() == HttpConversation::Outcome::kAskOn) {
      ask_on_ = true;
      return ReadStatus::kTimeout;
    }
    return disconnect(header_bytes_ > kMostHeaderBytes ? kHeadersTooLong
                      : code == CURLE_WRITE_ERROR
                          ? "the answer is longer than " + std::to_string(options_.max_body) +
                                " bytes: not " + options_.expected
                      : curl_error_[0] != '\0' ? curl_error_
                                               : curl_easy_strerror(code));
  }
  const ReadStatus followed = follow_redirection();
  if (followed != ReadStatus::kOk) return followed;
  if (elsewhere_ && status() == 401) {
    return disconnect(login_wanted_elsewhere(asked_));
  }
  const HttpAnswer given = answer();
  if (given.status == 401 && request_.digest && method_ == kDigest && !options_.user.empty() &&
      options_.rules.permits_basic(is_by_tls(asked_)) &&
      (offered_methods(easy_.get()) & (kDigest | kBasic)) == kBasic) {
    method_ = kBasic;
    if (!make_handle()) return fail(kNoCurl);
    send_request(request_.url, false);
    return ReadStatus::kTimeout;
  }
  if (given.status == 401 && std::exchange(logged_in_, false)) {
    // A rebooted camera does not know its earlier nonces. If it does not call them stale, libcurl
    // believes that the password is wrong. Try once more without them.
    if (!make_handle()) {
      return fail(kNoCurl);
    }
    ask_on_ = true;
    return ReadStatus::kTimeout;
  }
  logged_in_ = logged_in_ || (request_.digest && !options_.user.empty() && given.status != 401);
  PanTiltSample taken;
  std::string error;
  const HttpConversation::Outcome outcome = conversation_->take(given, &taken, &error);
  switch (outcome) {
    case HttpConversation::Outcome::kFailed:
    case HttpConversation::Outcome::kRefused:
      if (!worked_) {
        return fail(error);
      }
      conversation_->reset();
      return outcome == HttpConversation::Outcome::kRefused ? refuse(error) : disconnect(error);
    case HttpConversation::Outcome::kDisconnected:
      return disconnect(error);
    case HttpConversation::Outcome::kAskOn:
      ask_on_ = true;
      return ReadStatus::kTimeout;
    case HttpConversation::Outcome::kNothing:
      worked_ = true;
      return ReadStatus::kTimeout;
    case HttpConversation::Outcome::kSample:
      break;
  }
  *sample = taken;
  sample->pan_rad = mapped_rad(taken.pan_rad, options_.pan);
  sample->tilt_rad = mapped_rad(taken.tilt_rad, options_.tilt);
  sample->earliest_time_s = given.earliest_time_s;
  sample->latest_time_s = given.latest_time_s;
  sample->restarted = std::exchange(restarted_, false);
  worked_ = true;
  refusals_ = 0;
  backoff_.reset();
  for (const std::string& note : conversation_->notes()) notes_.add(options_.name, note);
  return ReadStatus::kOk;
}

ReadStatus HttpPollingSource::read(PanTiltSample& sample, double timeout_s) {
  const double deadline_s = monotonic_now_s() + timeout_s;
  for (;;) {
    if (stopped_) {
      return ReadStatus::kStopped;
    }
    if (failed_) {
      return ReadStatus::kFailed;
    }
    double now_s = monotonic_now_s();
    if (!under_way_ && (ask_on_ || now_s >= due_s_)) {
      start_request(now_s);
    }
    CURLcode code = CURLE_OK;
    if (under_way_ && request_is_over(&code)) {
      const ReadStatus status = finish_request(code, &sample);
      if (status != ReadStatus::kTimeout) {
        return status;
      }
    }
    now_s = monotonic_now_s();
    if (now_s >= deadline_s) {
      return ReadStatus::kTimeout;
    }
    if (!ask_on_) {
      // Until the transfer progresses, stop() is called, or the time is over.
      const double until_s = under_way_ ? deadline_s : std::min(due_s_, deadline_s);
      curl_multi_poll(multi_.get(), nullptr, 0, poll_milliseconds(until_s - now_s), nullptr);
    }
  }
}

}  // namespace

std::string take_http_url(Url* url, HttpPollingOptions* options) {
  std::string error;
  const bool is_url = parse_url(options->url, url, &error);
  options->name = url->shown;
  options->configured = *url;
  if (!is_url) {
    return error;
  }
  if (options->user.empty() && options->password.empty()) {
    options->user = url->user;
    options->password = url->password;
  }
  return url->scheme == "http" || url->scheme == "https"
             ? ""
             : "the URL must be http://host[:port] or https://host[:port]";
}

std::unique_ptr<PanTiltSource> open_http_polling(HttpPollingPlan plan) {
  return std::make_unique<HttpPollingSource>(std::move(plan));
}

}  // namespace alidade
