#include "alidade_ros/http_client.h"

#include <curl/curl.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

namespace alidade_ros {
namespace {

constexpr std::size_t kMaxAnswerBytes = 16 << 20;
constexpr double kRequestTimeoutS = 10;  // without data
constexpr int kStopPollMs = 100;

// CURL and CURLM are both void.
struct EasyDeleter {
  void operator()(CURL* easy) const { curl_easy_cleanup(easy); }
};
struct MultiDeleter {
  void operator()(CURLM* multi) const { curl_multi_cleanup(multi); }
};
struct ListDeleter {
  void operator()(curl_slist* list) const { curl_slist_free_all(list); }
};

void initialise_curl() {
  // Once per process; its other libraries may have done so.
  static const CURLcode code = curl_global_init(CURL_GLOBAL_DEFAULT);
  (void)code;
}

std::string token_of(const EdgeAddress& address, std::string* error) {
  std::string token;
  if (!address.token_env.empty()) {
    const char* value = std::getenv(address.token_env.c_str());
    if (value == nullptr) *error = "the environment variable " + address.token_env + " is not set";
    if (value != nullptr) token = value;
  } else if (!address.token_file.empty()) {
    std::ifstream file(address.token_file);
    if (!std::getline(file, token)) *error = "cannot read the token file " + address.token_file;
  }
  while (!token.empty() && (token.back() == '\r' || token.back() == '\n')) token.pop_back();
  // A line feed in a header would start another header.
  if (token.find_first_of("\r\n") != std::string::npos) *error = "the token has several lines";
  return token;
}

// The API's errors are {"error": "one line"}.
std::string error_of(const std::string& url, long status, const std::string& body) {
  std::string said;
  const auto json = nlohmann::json::parse(body, nullptr, false);
  if (json.is_object() && json.contains("error") && json["error"].is_string()) {
    said = ": " + json["error"].get<std::string>();
  }
  return url + " answers " + std::to_string(status) + said;
}

}  // namespace

std::string wrong_with(const EdgeAddress& address) {
  if (address.url.find('@') != std::string::npos) {
    return "url: must hold neither user nor password; use token_env or token_file";
  }
  const bool http = address.url.rfind("http://", 0) == 0 || address.url.rfind("https://", 0) == 0;
  if (!http) return "url: \"" + address.url + "\" must begin with http:// or https://";
  if (!address.token_env.empty() && !address.token_file.empty()) {
    return "token_env and token_file exclude each other";
  }
  return "";
}

// One exchange, on its own connection.
class HttpClient::Transfer {
 public:
  using Clock = std::chrono::steady_clock;

  Transfer(const HttpClient& client, const std::string& path)
      : client_(client),
        url_(client.address_.url + path),
        easy_(curl_easy_init()),
        multi_(curl_multi_init()) {
    curl_easy_setopt(easy_.get(), CURLOPT_URL, url_.c_str());
    curl_easy_setopt(easy_.get(), CURLOPT_NOSIGNAL, 1L);
#if LIBCURL_VERSION_NUM >= 0x075700  // Noetic's is older
    // A node that ends need not wait for a name look-up.
    curl_easy_setopt(easy_.get(), CURLOPT_QUICK_EXIT, 1L);
#endif
    curl_easy_setopt(easy_.get(), CURLOPT_CONNECTTIMEOUT_MS,
                     std::lround(client.address_.connect_timeout_s * 1000));
    curl_easy_setopt(easy_.get(), CURLOPT_ERRORBUFFER, error_text_);
    curl_easy_setopt(easy_.get(), CURLOPT_WRITEFUNCTION, &Transfer::write);
    curl_easy_setopt(easy_.get(), CURLOPT_WRITEDATA, this);
    const std::string token = token_of(client.address_, &error_);
    if (!token.empty()) add_header("Authorization: Bearer " + token);
  }

  ~Transfer() { curl_multi_remove_handle(multi_.get(), easy_.get()); }
  Transfer(const Transfer&) = delete;
  Transfer& operator=(const Transfer&) = delete;

  void add_header(const std::string& line) {
    curl_slist* longer = curl_slist_append(headers_.get(), line.c_str());
    (void)headers_.release();
    headers_.reset(longer);
  }

  CURL* easy() { return easy_.get(); }

  // The transfer ends if on_bytes returns false, or after silence for silence_timeout_s.
  void run(double silence_timeout_s, std::function<bool(const char*, std::size_t)> on_bytes) {
    if (!error_.empty()) return;
    on_bytes_ = std::move(on_bytes);
    heard_at_ = Clock::now();
    const std::chrono::duration<double> patience(silence_timeout_s);
    curl_easy_setopt(easy_.get(), CURLOPT_HTTPHEADER, headers_.get());
    curl_multi_add_handle(multi_.get(), easy_.get());
    int running = 1;
    while (running > 0 && !client_.stopped()) {
      curl_multi_perform(multi_.get(), &running);
      if (running > 0) curl_multi_poll(multi_.get(), nullptr, 0, kStopPollMs, nullptr);
      if (Clock::now() - heard_at_ > patience) {
        error_ = url_ + ": silent for " + std::to_string(std::lround(silence_timeout_s)) + " s";
        return;
      }
    }
    if (client_.stopped()) {
      error_ = "stopped";
      return;
    }
    int left = 0;
    const CURLMsg* message = curl_multi_info_read(multi_.get(), &left);
    if (message != nullptr && message->data.result != CURLE_OK && !ended_by_reader_) {
      const char* why =
          error_text_[0] != '\0' ? error_text_ : curl_easy_strerror(message->data.result);
      error_ = url_ + ": " + why;
    }
  }

  [[nodiscard]] long status() const {
    long status = 0;
    curl_easy_getinfo(easy_.get(), CURLINFO_RESPONSE_CODE, &status);
    return status;
  }
  [[nodiscard]] const std::string& error() const { return error_; }
  [[nodiscard]] const std::string& url() const { return url_; }

 private:
  static std::size_t write(char* bytes, std::size_t size, std::size_t count, void* self) {
    auto& transfer = *static_cast<Transfer*>(self);
    transfer.heard_at_ = Clock::now();
    if (transfer.on_bytes_(bytes, size * count)) return size * count;
    transfer.ended_by_reader_ = true;
    return 0;
  }

  const HttpClient& client_;
  std::string url_;
  std::unique_ptr<CURL, EasyDeleter> easy_;
  std::unique_ptr<CURLM, MultiDeleter> multi_;
  std::unique_ptr<curl_slist, ListDeleter> headers_;
  char error_text_[CURL_ERROR_SIZE] = {};
  std::function<bool(const char*, std::size_t)> on_bytes_;
  Clock::time_point heard_at_;
  bool ended_by_reader_ = false;
  std::string error_;
};

HttpClient::HttpClient(EdgeAddress address) : address_(std::move(address)) {
  initialise_curl();
  while (!address_.url.empty() && address_.url.back() == '/') address_.url.pop_back();
}

HttpClient::~HttpClient() = default;

HttpClient::Answer HttpClient::request(const std::string& path, const std::string* json) {
  Transfer transfer(*this, path);
  if (json != nullptr) {
    transfer.add_header("Content-Type: application/json");
    curl_easy_setopt(transfer.easy(), CURLOPT_POSTFIELDSIZE_LARGE,
                     static_cast<curl_off_t>(json->size()));
    curl_easy_setopt(transfer.easy(), CURLOPT_POSTFIELDS, json->c_str());
  }
  Answer answer;
  transfer.run(kRequestTimeoutS, [&answer](const char* bytes, std::size_t size) {
    answer.body.append(bytes, size);
    return answer.body.size() <= kMaxAnswerBytes;
  });
  answer.error = transfer.error();
  answer.status = transfer.status();
  if (answer.body.size() > kMaxAnswerBytes) answer.error = transfer.url() + ": answer too large";
  if (answer.error.empty() && (answer.status < 200 || answer.status >= 300)) {
    answer.error = error_of(transfer.url(), answer.status, answer.body);
  }
  return answer;
}

HttpClient::Answer HttpClient::get(const std::string& path) { return request(path, nullptr); }

HttpClient::Answer HttpClient::post(const std::string& path, const std::string& json) {
  return request(path, &json);
}

std::string HttpClient::stream(const std::string& path,
                               const std::function<bool(const char*, std::size_t)>& on_bytes) {
  Transfer transfer(*this, path);
  transfer.add_header("Accept: text/event-stream");
  std::string refusal;
  transfer.run(address_.silence_timeout_s, [&](const char* bytes, std::size_t size) {
    if (transfer.status() == 200) return on_bytes(bytes, size);
    refusal.append(bytes, size);
    return refusal.size() < kMaxAnswerBytes;
  });
  if (!transfer.error().empty()) return transfer.error();
  if (transfer.status() != 200) return error_of(transfer.url(), transfer.status(), refusal);
  return transfer.url() + ": the edge ended the stream";
}

void HttpClient::wait(double seconds) {
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait_for(lock, std::chrono::duration<double>(seconds), [this] { return stopped_; });
}

void HttpClient::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stopped_ = true;
  }
  changed_.notify_all();
}

bool HttpClient::stopped() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return stopped_;
}

}  // namespace alidade_ros
