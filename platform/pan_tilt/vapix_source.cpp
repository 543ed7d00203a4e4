#include "platform/pan_tilt/vapix_source.h"

#include <curl/curl.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <mutex>
#include <utility>

#include "platform/pan_tilt/vapix_answer.h"
#include "platform/system/backoff.h"
#include "platform/system/clock.h"
#include "platform/system/url.h"

namespace alidade {
namespace {

constexpr std::size_t kMaxBody = 4096;  // bytes; a position has about 100
constexpr double kLongestWait_s = 10;   // keeps the milliseconds of a wait within an int

std::once_flag curl_initialised;

std::string position_url(const Url& url, int camera) {
  const std::string base =
      url.bare.back() == '/' ? url.bare.substr(0, url.bare.size() - 1) : url.bare;
  return base + "/axis-cgi/com/ptz.cgi?query=position" +
         (camera > 0 ? "&camera=" + std::to_string(camera) : "");
}

}  // namespace

class VapixSource::Implementation {
 public:
  explicit Implementation(const VapixSourceOptions& options);
  ~Implementation();

  ReadStatus read(PanTiltSample& sample, double timeout_s);

  void stop() {
    stopped_ = true;
    if (multi_ != nullptr) {
      curl_multi_wakeup(multi_);
    }
  }

  const std::string& error() const { return error_; }
  const std::string& name() const { return name_; }

 private:
  static std::size_t on_header(char* data, std::size_t size, std::size_t count, void* self);
  static std::size_t on_body(char* data, std::size_t size, std::size_t count, void* self);
  void start_poll(double now_s);
  bool poll_is_over(CURLcode* code);
  ReadStatus finish_poll(CURLcode code, PanTiltSample* sample);
  void wait(double seconds);
  ReadStatus fail(const std::string& error);
  ReadStatus disconnect(const std::string& error);

  VapixSourceOptions options_;
  std::string name_;
  std::string error_;
  bool failed_ = false;
  std::atomic<bool> stopped_{false};

  CURLM* multi_ = nullptr;
  CURL* easy_ = nullptr;  // one for all polls: it keeps the connection and the digest's nonce
  char curl_error_[CURL_ERROR_SIZE] = "";

  double period_s_;
  double due_s_ = 0;  // when the next poll is to be sent
  Backoff backoff_;
  bool restarted_ = true;

  // The poll under way.
  bool under_way_ = false;
  double started_s_ = 0;
  double previous_answer_s_ = 0;  // of this poll: a 401 before the answer
  double answer_s_ = 0;           // when the first bytes of the latest answer were here
  std::string body_;
};

VapixSource::Implementation::Implementation(const VapixSourceOptions& options)
    : options_(options), period_s_(1 / options.rate_hz), backoff_(options.max_backoff_s) {
  std::call_once(curl_initialised, [] { curl_global_init(CURL_GLOBAL_DEFAULT); });
  Url url;
  std::string error;
  const bool is_url = parse_url(options.url, &url, &error);
  name_ = url.bare;
  if (!is_url) {
    (void)fail(error);
    return;
  }
  if ((url.scheme != "http" && url.scheme != "https") || url.path != "/") {
    (void)fail("the URL must be http://host[:port] or https://host[:port], without a path");
    return;
  }
  if (!(options.rate_hz > 0)) {
    (void)fail("rate_hz must be positive");
    return;
  }
  if (options_.user.empty() && options_.password.empty()) {
    options_.user = url.user;
    options_.password = url.password;
  }
  multi_ = curl_multi_init();
  easy_ = curl_easy_init();
  if (multi_ == nullptr || easy_ == nullptr) {
    (void)fail("libcurl does not start");
    return;
  }
  curl_easy_setopt(easy_, CURLOPT_URL, position_url(url, options_.camera).c_str());
  if (!options_.user.empty()) {
    curl_easy_setopt(easy_, CURLOPT_HTTPAUTH, CURLAUTH_DIGEST);
    curl_easy_setopt(easy_, CURLOPT_USERNAME, options_.user.c_str());
    curl_easy_setopt(easy_, CURLOPT_PASSWORD, options_.password.c_str());
  }
  curl_easy_setopt(easy_, CURLOPT_TIMEOUT_MS, std::lround(1e3 * options_.timeout_s));
  curl_easy_setopt(easy_, CURLOPT_NOPROXY, "*");
  curl_easy_setopt(easy_, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(easy_, CURLOPT_ERRORBUFFER, curl_error_);
  curl_easy_setopt(easy_, CURLOPT_HEADERFUNCTION, &Implementation::on_header);
  curl_easy_setopt(easy_, CURLOPT_HEADERDATA, this);
  curl_easy_setopt(easy_, CURLOPT_WRITEFUNCTION, &Implementation::on_body);
  curl_easy_setopt(easy_, CURLOPT_WRITEDATA, this);
}

VapixSource::Implementation::~Implementation() {
  if (under_way_) {
    curl_multi_remove_handle(multi_, easy_);
  }
  curl_easy_cleanup(easy_);
  curl_multi_cleanup(multi_);
}

std::size_t VapixSource::Implementation::on_header(char* data, std::size_t size, std::size_t count,
                                                   void* self) {
  auto* poll = static_cast<Implementation*>(self);
  const std::size_t bytes = size * count;
  if (std::string_view(data, bytes).substr(0, 5) == "HTTP/") {
    poll->previous_answer_s_ = poll->answer_s_;
    poll->answer_s_ = monotonic_now_s();
    poll->body_.clear();
  }
  return bytes;
}

std::size_t VapixSource::Implementation::on_body(char* data, std::size_t size, std::size_t count,
                                                 void* self) {
  auto* poll = static_cast<Implementation*>(self);
  const std::size_t bytes = size * count;
  if (poll->body_.size() + bytes > kMaxBody) {
    return 0;  // ends the transfer with CURLE_WRITE_ERROR
  }
  poll->body_.append(data, bytes);
  return bytes;
}

ReadStatus VapixSource::Implementation::fail(const std::string& error) {
  error_ = name_ + ": " + error;
  failed_ = true;
  return ReadStatus::kFailed;
}

ReadStatus VapixSource::Implementation::disconnect(const std::string& error) {
  error_ = name_ + ": " + error;
  restarted_ = true;
  due_s_ = monotonic_now_s() + backoff_.next_s();
  return ReadStatus::kDisconnected;
}

void VapixSource::Implementation::start_poll(double now_s) {
  // The next point of the grid that lies ahead.
  due_s_ = due_s_ == 0
               ? now_s + period_s_
               : due_s_ + period_s_ * std::max(1.0, std::ceil((now_s - due_s_) / period_s_));
  body_.clear();
  curl_error_[0] = '\0';
  answer_s_ = 0;
  previous_answer_s_ = 0;
  under_way_ = true;
  started_s_ = monotonic_now_s();
  curl_multi_add_handle(multi_, easy_);
}

bool VapixSource::Implementation::poll_is_over(CURLcode* code) {
  int running = 0;
  curl_multi_perform(multi_, &running);
  int queued = 0;
  const CURLMsg* message = curl_multi_info_read(multi_, &queued);
  if (message == nullptr || message->msg != CURLMSG_DONE) {
    return false;
  }
  *code = message->data.result;
  curl_multi_remove_handle(multi_, easy_);
  under_way_ = false;
  return true;
}

ReadStatus VapixSource::Implementation::finish_poll(CURLcode code, PanTiltSample* sample) {
  if (code == CURLE_WRITE_ERROR) {
    return disconnect("the answer is longer than " + std::to_string(kMaxBody) +
                      " bytes: not a camera's position");
  }
  if (code != CURLE_OK) {
    return disconnect(curl_error_[0] != '\0' ? curl_error_ : curl_easy_strerror(code));
  }
  long status = 0;
  curl_easy_getinfo(easy_, CURLINFO_RESPONSE_CODE, &status);
  if (status == 401) {
    long offered = 0;
    curl_easy_getinfo(easy_, CURLINFO_HTTPAUTH_AVAIL, &offered);
    return fail(options_.user.empty() ? "the camera wants a user and a password (401)"
                : (offered & static_cast<long>(CURLAUTH_DIGEST)) == 0
                    ? "the camera does not offer HTTP digest authentication (401)"
                    : "wrong user or password (401)");
  }
  if (status != 200) {
    return disconnect("HTTP status " + std::to_string(status) + " for /axis-cgi/com/ptz.cgi");
  }
  VapixPosition position;
  std::string error;
  if (!parse_vapix_position(body_, &position, &error)) {
    return disconnect(error);
  }
  // The request was sent after the connection stood (libcurl counts from a moment after started_s_)
  // and after the 401 that may have gone before. CURLINFO_PRETRANSFER_TIME_T is too late: it is taken
  // when the request has left.
  curl_off_t connected_us = 0;
  curl_off_t encrypted_us = 0;
  curl_easy_getinfo(easy_, CURLINFO_CONNECT_TIME_T, &connected_us);
  curl_easy_getinfo(easy_, CURLINFO_APPCONNECT_TIME_T, &encrypted_us);
  const double ready_s =
      started_s_ + 1e-6 * static_cast<double>(std::max(connected_us, encrypted_us));
  *sample = PanTiltSample{};
  sample->latest_time_s = answer_s_;
  sample->earliest_time_s = std::min(std::max(ready_s, previous_answer_s_), answer_s_);
  sample->pan_rad = position.pan_rad;
  sample->tilt_rad = position.tilt_rad;
  sample->zoom = position.zoom;
  sample->restarted = std::exchange(restarted_, false);
  backoff_.reset();
  return ReadStatus::kOk;
}

// Until the transfer moves on, stop() is called, or the time is over.
void VapixSource::Implementation::wait(double seconds) {
  const double milliseconds = std::ceil(1e3 * std::clamp(seconds, 0.0, kLongestWait_s));
  curl_multi_poll(multi_, nullptr, 0, static_cast<int>(milliseconds), nullptr);
}

ReadStatus VapixSource::Implementation::read(PanTiltSample& sample, double timeout_s) {
  const double deadline_s = monotonic_now_s() + timeout_s;
  for (;;) {
    if (stopped_) {
      return ReadStatus::kStopped;
    }
    if (failed_) {
      return ReadStatus::kFailed;
    }
    double now_s = monotonic_now_s();
    if (!under_way_ && now_s >= due_s_) {
      start_poll(now_s);
    }
    CURLcode code = CURLE_OK;
    if (under_way_ && poll_is_over(&code)) {
      return finish_poll(code, &sample);
    }
    now_s = monotonic_now_s();
    if (now_s >= deadline_s) {
      return ReadStatus::kTimeout;
    }
    wait((under_way_ ? deadline_s : std::min(due_s_, deadline_s)) - now_s);
  }
}

VapixSource::VapixSource(const VapixSourceOptions& options)
    : implementation_(std::make_unique<Implementation>(options)) {}
VapixSource::~VapixSource() = default;
ReadStatus VapixSource::read(PanTiltSample& sample, double timeout_s) {
  return implementation_->read(sample, timeout_s);
}
void VapixSource::stop() { implementation_->stop(); }
std::string VapixSource::error() const { return implementation_->error(); }
std::string VapixSource::name() const { return implementation_->name(); }

}  // namespace alidade
